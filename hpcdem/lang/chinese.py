"""Names of what frames hold, and of colours, in Chinese, for the page that shows them."""

from __future__ import annotations

FIELDS = {
    "stress": "应力", "principal": "主应力", "displacement": "位移", "velocity": "速度", "acceleration": "加速度",
    "force": "力", "contact_force": "接触力", "nodal_force": "节点力", "axial_force": "轴力", "shear_force": "剪力",
    "membrane": "薄膜力", "bending": "板弯矩", "transverse": "横向剪力", "plastic_curvature": "塑性曲率",
    "bond_force": "胶结力", "reaction": "反力", "moment": "弯矩", "torque": "力矩", "spin": "角速度", "angle": "转角",
    "rotation": "转动", "temperature": "温度", "moisture": "含水量", "mean_moisture": "平均含水量", "suction": "基质吸力",
    "mean_temperature": "平均温度", "fluid_temperature": "流体温度",
    "environment_temperature": "环境温度", "heat_flux": "热流密度", "transfer_coefficient": "换热系数",
    "pressure": "压力", "fluid_pressure": "流体压力", "water_pressure": "水压力", "pack_pressure": "支撑剂充填压力",
    "pore_pressure": "孔隙压力", "normal_stress": "法向应力", "shear_stress": "剪应力", "saturation": "饱和度",
    "aperture": "开度", "flow_rate": "流量", "fluid_velocity": "流速", "inflow": "流入量", "condition": "条件",
    "proppant_concentration": "支撑剂浓度", "opening": "张开", "slip": "滑移", "damage": "损伤", "mode": "破坏方式",
    "state": "状态", "break_time": "破坏时间", "break_energy": "破坏能量", "joint_area": "节理面积", "area": "面积",
    "volume": "体积", "length": "长度", "distance": "距离", "position": "位置", "radius": "半径", "mass": "质量",
    "inertia": "转动惯量", "density": "密度", "kinetic_energy": "动能", "strain_energy": "应变能", "strain": "应变",
    "plastic_strain": "塑性应变", "creep_strain": "蠕变应变", "tensile_strain": "拉伸塑性应变", "x": "x 坐标",
    "y": "y 坐标", "z": "z 坐标", "vx": "x 向速度", "vy": "y 向速度", "fx": "x 向力", "fy": "y 向力", "fn": "法向力",
    "fs": "切向力", "overlap": "重叠量", "number": "编号", "gid": "编号", "id": "编号", "id1": "颗粒一",
    "id2": "颗粒二", "node": "节点", "corners": "角点数", "element_model": "单元本构", "joint_model": "节理本构",
    "element_1": "单元一", "element_2": "单元二", "first": "起点", "last": "终点", "second": "第二点",
    "first_node": "起始节点", "second_node": "第二节点", "last_node": "末端节点", "bolt_state": "锚杆状态", "liner_state": "衬砌状态",
    "bond_state": "胶结状态", "bolt": "锚杆", "liner": "衬砌", "host": "所在单元", "fixed": "固定方向",
    "constraint": "约束类型", "quiet": "无反射", "incoming": "入射波", "group": "组", "color": "颜色", "colour": "颜色",
    "material": "材料", "birth": "生成步", "fix": "固定", "clump": "颗粒簇", "members": "成员数", "kind": "类型",
    "bonded": "胶结", "rubber": "橡胶", "hertz": "Hertz 接触", "link": "类别", "ebmod": "法向模量", "gbmod": "切向模量",
    "tstrength": "抗拉强度", "sstrength": "抗剪强度", "fric": "摩擦系数", "shear": "剪切模量", "poiss": "泊松比",
    "kn": "法向刚度", "ks": "切向刚度", "damp": "阻尼", "contact": "接触", "yielded": "屈服", "work": "功",
}  # fmt: skip
"""Fields of frames, by their names without component."""
COMPONENTS = {
    "max": "最大", "middle": "中间", "min": "最小", "mean": "平均", "mises": "Mises", "deviator": "偏", "shear": "剪切",
    "normal": "法向", "first": "起点", "last": "终点", "largest": "最大", "smallest": "最小",
}  # fmt: skip
"""Suffixes of their names; xx, x and so on are unchanged."""
LEGEND = {
    "tension": "拉裂", "mixed": "拉剪", "shear": "剪裂", "yielded": "屈服", "initial": "初始",
}  # fmt: skip
"""Words of legends: modes of broken joints."""
COLOURS = {
    "viridis": "绿黄(viridis)", "cividis": "蓝黄(cividis)", "plasma": "紫黄(plasma)", "yellow-brown": "黄—褐",
    "yellow-blue": "黄—蓝", "yellow-green": "黄—绿", "greys": "灰度", "blue-red": "蓝—红", "blue-yellow-red": "蓝—黄—红",
    "orange-violet": "橙—紫", "spectral": "光谱", "rainbow": "彩虹",
}  # fmt: skip
"""Colours of fields."""


def field_name(name: str) -> str:
    """A field of a frame, such as ``stress_yy``, in Chinese; its own name where the table does not know it.

    Parameters
    ----------
    name : str
        Of a field or a vector.
    """
    if name in FIELDS:
        return FIELDS[name]
    stem = name
    ends: list[str] = []
    while "_" in stem:
        stem, _, end = stem.rpartition("_")
        ends.insert(0, end)
        if stem in FIELDS:
            words = [COMPONENTS.get(end, end) for end in ends]
            before = "".join(word for end, word in zip(ends, words, strict=True) if end in COMPONENTS)
            after = "_".join(word for end, word in zip(ends, words, strict=True) if end not in COMPONENTS)
            if stem == "stress" and set(ends) & {"max", "middle", "min"}:
                return f"{before}主应力"
            return f"{before}{FIELDS[stem]}{f' {after}' if after else ''}"
    return name
