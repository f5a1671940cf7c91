"""What commands and models of both languages do, in Chinese, a line each: for the Chinese reference pages
(docs/zdem_reference.zh.md, docs/pcdc_reference.zh.md), and what their keywords mean, by their English: where that
changes, or is new, the pages have the English."""

from __future__ import annotations

ZDEM = {
    "START": "开始新的计算:没有颗粒和墙,步数为 0。",
    "RESTORE": "从 hpcdem 的重启文件继续;先在脚本所在目录找,再到其下的 ./data 找。",
    "LOAD": "用文本文件(x y r [组])中的颗粒,或 ZDEM、hpcdem 的 all_<step>.dat 开始新的计算。",
    "STOP": "结束运行;其后的内容不再读取。",
    "BOX": "模型的范围:四面只在内侧起作用的墙;越出的颗粒被删除。",
    "WALL": "给出 nodes 时建立(或替换)一面墙;不给时修改其性质。墙两侧都起作用(SET wallside left 只用左侧)。",
    "BALL": "建立一个颗粒。",
    "GEN": "在矩形内生成颗粒:num 为随机、互不重叠,grid 为规则排列。",
    "GLINE": "从 p1 到 p2 生成一排相同的颗粒。",
    "CLUMP": "由圆盘组成的刚性颗粒:来自文件,或把已有颗粒连成一体。",
    "DEL": "删除颗粒及其接触和胶结。",
    "EXP": "把颗粒的 x y r 写成 LOAD 可读的文本文件。",
    "PROP": "设置颗粒的性质、速度、颜色和组;带胶结关键字时同时在所选颗粒之间建立胶结。",
    "INIT": "与 PROP 相同。",
    "BOND": "断开两端都在所选颗粒中的胶结。",
    "FIX": "所选颗粒在这些自由度上保持其速度,不受力的影响。",
    "FREE": "取消 FIX。",
    "SET": "各种设置,一行可写多项;输出间隔为 0 或负数表示关闭。",
    "CYC": "计算给定的步数;开始前写一帧 all_<step>_ini。",
    "IMPLE": "计算到墙以其速度移动了给定的距离为止。",
    "SAV": "以此名写重启文件,放在脚本旁。",
    "HIST": "每隔若干步记录一个数,写入 data/hist_id_<id>.dat 和 hist_<id>.csv。",
    "PLOT": "运行结束时把一个记录对另一个记录写成文本并绘图。",
    "DRAW": "运行中出图(需加 --draw 启动)。",
    "LOG": "接受但不起作用:日志写到标准输出。",
    "PAUSE": "接受但不起作用:运行不会等待。",
}

PCDC = {
    "model run-time": "此后 model solve 最多计算的时间,从其开始或从 model reset 的 start-time 起算;没有其他目标时,每次 model solve 计算这么长时间。",
    "model solve-check": "model solve 中两次检查不平衡力比率之间的步数。",
    "model cycle-option": "耦合计算的一个循环里,各模块的时间步和步数;支撑剂与流体同步。",
    "model reset": "设置各模块的时钟;边界条件的表、井的阶段和滤失都按它计时。",
    "model query": "在日志中说明某个模块算到的时间及其时间步。",
    "model plane-strain": "平面应变(平面模型的默认状态),取消 model plane-stress。",
    "model plane-stress": "平面应力:厚 1 m、两面不受力的板,垂直于平面的应力为零;须在 element initial 和第一步之前给出。",
    "model plot-frequency": "窗口刷新的步数:此处没有作用。",
    "model render-interval": "同上。",
    "model render-auto": "自动刷新:此处没有作用。",
    "model collision-detect": "接触搜索的方法:此处没有作用。",
    "model collision-compute": "接触力的算法:此处没有作用。",
    "element-face list summary": "在日志中列出面的数目,按模型和组。",
    "face-joint list summary": "在日志中列出节理的数目,按模型和组。",
    "node thermal-initialize": "节点现在的温度,同 node initial temperature。",
    "node hydraulic-initialize": "流动节点现在的流体及其温度。",
    "node history": "监测节点的温度,多个节点时取平均。",
    "table": "由成对的数给出的表;relative-time:从边界条件采用它的时刻起计时。",
    "device list": "在日志中说明计算所用的进程、线程和处理器。",
    "device switch-to": "换计算设备:此处没有作用。",
    "view": "窗口的显示:此处没有作用,见 hpcdem view。",
    "boundary-model": "C# 代码的边界条件:拒绝,改用 Python 函数。",
    "model new": "新模型:除 Python 变量外,之前的内容全部不保留。",
    "model save": "把整个状态存盘:网格、模型、运动、裂纹、监测,以及名称以 m_ 开头的变量和函数。",
    "model restore": "恢复存盘的状态及其 m_ 变量和函数。",
    "model gravity": "此后的重力。",
    "model units": "声明此后数值的单位制:不合常理的值会警告;数值一律不换算。",
    "model option": "计算的开关(动力、碰撞、大变形、能量等)。",
    "model time-step": "动力计算的时间步;不给时在第一步估算。",
    "model step": "计算给定的步数。",
    "model field": "在单元中扩散的场（如含水量）的时钟。",
    "model solve": "计算到 ratio、cycles、time 之一先达到为止;elastic 直接求静力平衡,hydraulic、thermal 为隐式求解。",
    "model sub-step": "耦合计算中各部分的子步数。",
    "model rayleigh": "动力计算中单元的 Rayleigh 阻尼。",
    "model creep": "Burgers 单元从此蠕变,或停止蠕变。",
    "geometry create polyline": "折线。",
    "geometry create polygon": "闭合多边形。",
    "geometry create rectangle": "边与坐标轴平行的矩形。",
    "geometry create circle": "圆。",
    "geometry create arc": "圆弧,逆时针。",
    "geometry create point": "单独的点,成为网格的节点。",
    "geometry create fractures": "按统计分布生成的一组裂隙(直线),供剖分或切割网格用。",
    "geometry create box": "边与坐标轴平行的长方体。",
    "geometry create sphere": "球。",
    "geometry create cylinder": "圆柱。",
    "geometry create cone": "圆锥或圆台。",
    "geometry create disc": "圆盘面:网格沿它切开。",
    "geometry create plane": "无限平面。",
    "geometry create extrude": "把图层中的多边形沿一段路径拉伸成的物体。",
    "geometry create revolve": "把图层中的多边形绕其平面内的轴旋转成的物体。",
    "geometry import": "导入 DXF 文件中的线。",
    "geometry transform": "平移、旋转或缩放一个图层。",
    "geometry delete": "删除图层。",
    "geometry scale": "按比例缩放图层;不给图层时为全部。",
    "geometry translate": "平移图层;不给图层时为全部。",
    "geometry export": "把图层写成 DXF 文件(单位米)。",
    "mesh create": "用 Gmsh 剖分图层内部;多次剖分得到多个物体,可相互接触。",
    "mesh structured": "矩形的规则网格。",
    "mesh equilateral": "矩形内近似等边的三角形网格。",
    "mesh import": "导入其他程序的网格(.msh、.inp 等),其物理组以及单元、节点、面的集合成为组。",
    "mesh intersect": "位于图层上的网格边成为裂纹。",
    "mesh glue": "分别剖分的物体在其面相互贴合处以节理相连;两侧网格不同处单元被切分。",
    "element create brick": "平行四边形(三维为平行六面体)的规则网格,由一个角点和各棱的端点给定。",
    "element create geometry": "用 Gmsh 在封闭线内剖分三角形,每段线有各自的网格尺寸;其余的线和点成为网格的边和节点,边界外的部分被裁剪。",
    "element create geometry-patch": "用 Gmsh 在封闭折线内剖分三角形,网格沿约束线和约束点。",
    "element create geometry-boundary": "用 Gmsh 在封闭边界内剖分三角形,内边界为孔洞或填充。",
    "element create hollow-circle": "用 Gmsh 剖分圆环内的三角形。",
    "element delete": "删除单元;首次赋模型或条件之前从网格中删去,之后等同于开挖。",
    "element densify": "四叉树加密:四边形对分到给定长度,相邻单元随之过渡,边上有悬挂点的切成三角形。",
    "element hide": "在图中和范围选择中隐藏单元,或重新显示;计算不受影响。",
    "element list summary": "在日志中列出单元的数目,按模型和组。",
    "element collision": "这些单元是否参与接触判断。",
    "element water": "水位线以下模型表面的静水压力,随表面移动;水面线达不到处没有水。",
    "model add node": "增加节点,供随后增加的单元使用。",
    "model add element": "按节点号增加一个单元。",
    "element from": "从其他程序引入单元(请用 mesh import)。",
    "model scale": "按比例缩放网格坐标。",
    "model translate": "平移网格。",
    "mesh quality": "报告网格质量:角度、尺寸。",
    "element group": "把单元放入组。",
    "element c-model": "单元的本构模型及其参数。",
    "element law": "读取、检查、编译 Python 文件中的本构,但不赋给单元。",
    "element property": "修改单元参数,其余不变。",
    "element initial": "初始应力,拉为正;未给的分量为零,平面问题中未给的 stress-zz 取平面应变值 ν(xx+yy)。超过单元强度时在日志中提示。",
    "element reset state": "清除单元的塑性状态,应力不变。",
    "element reset kelvin-strain": "蠕变单元的 Kelvin 应变清零,应力和位移不变。",
    "element-face group": "把单元面放入组。",
    "element-face c-model": "表面的接触模型。",
    "element-face property": "修改接触参数,其余不变。",
    "element-face boundary": "表面的边界条件。",
    "element-face boundary remove": "取消表面的边界条件。",
    "face-joint group": "把节理放入组。",
    "face-joint c-model": "单元之间节理的模型;没有模型的节理永不断开。",
    "face-joint property": "修改已有模型的节理参数,其余不变。",
    "face-joint reset state": "清除未断节理的损伤;滑动节理只清除拉裂,已滑动的量保留。",
    "node group": "把节点放入组。",
    "node boundary": "节点的边界条件。",
    "node mechanical-damp": "节点的局部阻尼(0 到 1),代替模型的局部阻尼。",
    "node function": "读取、检查、编译 Python 文件中随位置和时间变化的函数,但不用于条件。",
    "node boundary remove": "取消节点的边界条件。",
    "node initial": "节点此刻的速度或温度。",
    "node reset velocity": "全部速度清零。",
    "node reset displacement": "位移从此处重新计算。",
    "flow-node initial": "流动节点(渗流通道的端点)此刻所含的流体;此前通道是干的。",
    "well create": "把范围内的流动节点连成一个井筒;井水作用于节点全在范围内的自由面。",
    "well stage": "给井增加一个阶段:定流量、定压力或关井。",
    "bolt create polyline": "沿给定的点安装锚杆,可在运行的任何阶段。",
    "bolt-element create": "两点之间的锚杆,岩体之外的部分被裁去,每段岩体内的部分为一根锚杆。",
    "bolt c-model": "锚杆单元的参数,从此生效。",
    "bolt-element group": "把锚杆单元放入组。",
    "bolt-node group": "把锚杆节点放入组。",
    "bolt-node boundary": "锚杆节点上给定的量。",
    "bolt-node boundary remove": "取消锚杆节点的条件。",
    "bolt delete": "立即拆除锚杆单元及其浆体。",
    "liner create": "在所选的自由面上铺设衬砌,可在运行的任何阶段,初始无内力。",
    "liner c-model": "衬砌单元的参数,从此生效。",
    "liner delete": "立即拆除衬砌单元。",
    "liner-element group": "把衬砌单元放入组。",
    "liner-node group": "把衬砌节点放入组。",
    "liner-node boundary": "衬砌节点上给定的量。",
    "liner-node boundary remove": "取消衬砌节点的条件。",
    "table create": "表:时间的函数,用于参数时为 x 或 y 的函数;点间线性,两端之外为常数。",
    "table delete": "删除表。",
    "field create": "随机场:逐单元、逐面或逐节理不同的参数。",
    "field delete": "删除随机场;已抽取的值不变。",
    "history create": "运行中记录一个数:单个对象、范围的和、平均、最小、最大,或模型的量。",
    "history delete": "停止一个监测;文件保留。",
    "history export": "把全部或部分监测并排写成 CSV。",
    "chart create": "建立图表。",
    "chart add": "向图表添加曲线:两个监测,或一组点,或沿线剖面。",
    "chart export": "把图表写成 CSV 和同名图片。",
    "output vtk": "供 ParaView 使用的帧:立即写,并每隔若干步写。",
    "output image": "模型当前状态的图片 <name>_<step>.png,可画帧中任一物理量。",
}

MODELS = {
    "mechanical-absorb-boundary-condition": "波可以穿出的面,同 m-s-b-c quiet on。",
    "mechanical-iso-elastic": "各向同性线弹性,大转动。",
    "null": "开挖:移去单元,旁边的面成为自由面;再赋其他模型即回填。",
    "mechanical-mohr-coulomb": "弹性,到 Mohr–Coulomb 强度或抗拉强度后塑性,大转动。",
    "user": "用户 Python 文件中的本构,见 user_laws.md。",
    "mechanical-burgers": "体积弹性,形状按 Burgers 模型蠕变(model creep on 时)。",
    "thermal-iso-heat": "热传导与热膨胀,与力学模型同时起作用。",
    "contact-mohr-coulomb": "表面接触:重叠势函数与 Coulomb 摩擦;两个表面取较小值。",
    "mechanical-stress-boundary-condition": "表面力:应力乘当前法向,拉为正。",
    "free-field": "自由场:竖直侧边之外地层继续延伸。",
    "moisture-diffusion": "土的水分扩散，与力学模型同时起作用。",
    "moisture-boundary-condition": "节点的含水量。",
    "moisture-flux-boundary-condition": "通过表面的水分；没有它时表面不透水。",
    "thermal-const-heat": "通过表面的热;没有它时表面绝热。",
    "classic-intrinsic-cohesive-interface": "单元之间的内聚节理:到强度为止保持,随后软化、断开,成为有摩擦的接触。",
    "joint-mohr-coulomb": "原有节理:法向、切向弹簧加库仑摩擦,可有黏聚力、抗拉强度和剪胀;滑动、张开、闭合,从不断开。",
    "joint-barton-bandis": "原有粗糙节理(Barton–Bandis):双曲线闭合,强度随 JRC、JCS 和滑动路径而变,有剪胀;从不断开。",
    "hydraulic-porous-medium": "节理中的流体:每条节理是其两节点间的通道。",
    "hydraulic-porous-proppant-medium": "节理中携带支撑剂的流体。",
    "thermal-fluid": "节理内流体的热:导热、对流、与两壁换热。",
    "mechanical-velocity-boundary-condition": "节点的速度或加速度;未给的分量自由。",
    "mechanical-force-boundary-condition": "每个节点上的力。",
    "mechanical-move-boundary-constraint": "节点的自由度。新约束与节点已有的约束、给定速度同时有效:两个方向即固定;相互矛盾的拒绝执行。",
    "hydraulic-constant-flow-boundary": "节点上的流体:压力、水位或流量三者之一。带范围的压力和水位使节点全在范围内的自由面受水压。",
    "hydraulic-proppant-boundary": "流动节点(包括井)进入的支撑剂。",
    "thermal-solid-boundary-condition": "节点的温度。",
    "thermal-flow-boundary-condition": "流动节点处流体的温度,例如注入流体的温度。",
    "mechanical-elastic-plastic": "锚杆:轴向弹性、理想塑性,浆体达到强度后滑移。",
    "bolt-node-constrain": "锚杆节点的速度或加速度。",
    "bolt-node-force-boundary-condition": "一根锚杆各节点上的力。",
    "beam": "衬砌:平面应变梁,弹性、理想塑性。",
    "liner-node-constrain": "衬砌节点的速度。",
    "liner-node-force-boundary-condition": "衬砌各节点上的力和弯矩。",
}

ZDEM_KEYWORDS = {
    "restart file": "重启文件",
    "file of particles": "颗粒文件",
    "factor on x, y and r": "x、y 和 r 的倍数",
    "only particles of the file within these bounds, before scaling": "只取文件中在此范围内的颗粒(缩放之前)",
    "x of the left wall": "左墙的 x",
    "x of the right wall": "右墙的 x",
    "y of the lower wall": "底墙的 y",
    "height above bottom": "底墙以上的高度",
    "normal stiffness, linear contacts only": "法向刚度,只用于线性接触",
    "shear stiffness, linear contacts only": "切向刚度,只用于线性接触",
    "friction coefficient": "摩擦系数",
    "number of the wall": "墙的编号",
    "end points P1 and P2": "端点 P1 和 P2",
    "normal stiffness": "法向刚度",
    "shear stiffness": "切向刚度",
    "colour, by name or number": "颜色,用名称或编号",
    "velocity in x, until it is changed": "x 方向速度,直到被修改",
    "velocity in y, until it is changed": "y 方向速度,直到被修改",
    "number of the particle": "颗粒编号",
    "centre": "圆心",
    "radius": "半径",
    "group the particles are put in": "颗粒所入的组",
    "particles asked for": "要求的颗粒数",
    "one particle on every node of a lattice": "规则点阵的每个节点一个颗粒",
    "first id of a lattice": "点阵的第一个编号",
    "radii drawn at random, a repeated one more often": "随机抽取的半径,重复给出的更常抽到",
    "left and right side of the rectangle": "矩形的左右边",
    "lower and upper side of the rectangle": "矩形的上下边",
    "first centre": "第一个圆心",
    "end of the row": "这一排的终点",
    "distance of neighbours over the sum of their radii": "相邻圆心距与半径之和的比",
    "clump file": "团块文件",
    "the origin of the file comes to this place": "文件的原点放在此处",
    "turns the file, anticlockwise": "文件逆时针转动的角度",
    "factor on all lengths of the file": "文件中所有长度的倍数",
    "the group as a fourth column": "第四列为组名",
    "density; per area unless SET disk off": "密度;除 SET disk off 外为单位面积的密度",
    "shear modulus G of the Hertz-Mindlin contact": "Hertz-Mindlin 接触的剪切模量 G",
    "Poisson ratio of the Hertz-Mindlin contact": "Hertz-Mindlin 接触的泊松比",
    "local damping: share of the force that acts against the motion": "局部阻尼:与运动方向相反的那部分力的比例",
    "the particles take the Hertz-Mindlin contact; a later kn or ks without it takes that back":
    "颗粒采用 Hertz-Mindlin 接触;此后不带它的 kn 或 ks 使之取消",
    "normal stiffness of the linear contact": "线性接触的法向刚度",
    "shear stiffness of the linear contact": "线性接触的切向刚度",
    "pairs of these particles follow a law in a Python file of the user (docs/user_laws.md); linear: a built-in "
    "one again":
    "这些颗粒之间遵循用户 Python 文件中的接触律(docs/user_laws.md);linear:恢复内置接触律",
    "this law is that of pairs of discs that have these two laws, instead of a law of particles":
    "此接触律用于分别具有这两种接触律的颗粒之间,而不是颗粒自身的接触律",
    "properties that this law declares": "该接触律声明的性质",
    "velocity in x": "x 方向速度",
    "velocity in y": "y 方向速度",
    "angular velocity, anticlockwise": "角速度,逆时针",
    "pressure that pushes each particle along x: force = pressure 2 R thickness (SET thickness), until it is "
    "changed":
    "沿 x 推动每个颗粒的压力:力 = 压力 × 2R × 厚度(SET thickness),直到被修改",
    "the same along y": "沿 y,同上",
    "moves the particles to this group; a particle is in one group": "把颗粒移入此组;一个颗粒只在一个组中",
    "model 1 bond: Young's modulus": "1 型胶结:杨氏模量",
    "model 1 bond: shear modulus": "1 型胶结:剪切模量",
    "model 1 bond: tensile strength": "1 型胶结:抗拉强度",
    "model 1 bond: cohesion": "1 型胶结:黏聚力",
    "marks the bonds as those of a membrane: kept and written, without any effect on the motion":
    "把胶结标记为橡皮膜的胶结:保存并输出,对运动没有作用",
    "the bonds have one shear stiffness, touching or open, so that opening and closing make no energy (docs/physics.md, "
    "Bonds)":
    "胶结无论接触还是张开都用同一剪切刚度,因此张开与闭合不会产生能量(docs/physics.md,Bonds)",
    "model 2 bond: tensile strength": "2 型胶结:抗拉强度",
    "model 2 bond: shear strength": "2 型胶结:抗剪强度",
    "largest gap that is bonded, up to 10 of the largest radius; the word alone keeps the default":
    "胶结允许的最大间隙,最多为最大半径的 10 倍;只写此词时取默认值",
    "factor on the radii in the search for bonds, see cratio of GLINE": "寻找胶结时半径的倍数,见 GLINE 的 cratio",
    "the only thing BOND does": "BOND 唯一的功能",
    "motion in x": "x 方向运动",
    "motion in y": "y 方向运动",
    "rotation": "转动",
    "time step; of DT and frac the one given last counts": "时间步;DT 和 frac 以后给出的为准",
    "gravity in x and y": "x 和 y 方向的重力",
    "volume that makes the mass: on pi r^2, off (or 0) 4/3 pi r^3, hex 2 sqrt(3) r^2":
    "计算质量所用的体积:on 为 pi r^2,off(或 0)为 4/3 pi r^3,hex 为 2 sqrt(3) r^2",
    "time step over sqrt(smallest mass / largest pair stiffness)": "时间步与 sqrt(最小质量 / 最大接触刚度) 之比",
    "lattice-solid damping, force -v times this": "格点固体阻尼,力为 -v 乘以此值",
    "share of the speed at which discs that are not bonded part again, from each other and from walls; 1: nothing "
    "is lost":
    "无胶结的圆盘之间及与墙碰撞后分离速度与接近速度之比(恢复系数);1:没有损失",
    "a line of progress every so many steps": "每隔这么多步一行进度",
    "a restart file .sav every so many steps": "每隔这么多步一个重启文件 .sav",
    "a frame .dat and .vtkhdf every so many steps": "每隔这么多步一帧 .dat 和 .vtkhdf",
    "a vector picture every so many steps": "每隔这么多步一幅矢量图",
    "a .vtk file every so many steps": "每隔这么多步一个 .vtk 文件",
    "a row of energy.csv every so many steps, and the energy budget at the end":
    "每隔这么多步在 energy.csv 写一行,并在结束时给出能量平衡表",
    "of the model, in the force of PROP xp, yp and the stresses of HIST":
    "模型厚度,用于 PROP xp、yp 的力和 HIST 的应力",
    "start of the random numbers of GEN": "GEN 随机数的种子",
    "sides of walls that act: left of P1->P2 (ZDEM up to 2.0) or both":
    "墙起作用的侧:P1->P2 的左侧(ZDEM 2.0 及以前)或两侧",
    "attempts of GEN per particle asked for; not set: GEN gives up after 1000 failures in a row":
    "GEN 每个所求颗粒的尝试次数;不给时连续失败 1000 次后停止",
    "folder of the results": "结果目录",
    "units of all that follows: values that are unlikely in them are warned of, histories and curves are labelled "
    "with them; no value is changed":
    "此后所有数值的单位制:不合常理的值会警告,监测量和曲线带此单位;数值一律不变",
    "steps": "步数",
    "the only thing that can be moved": "唯一可以移动的对象",
    "distance in x": "x 方向的距离",
    "distance in y": "y 方向的距离",
    "a frame .dat and .vtkhdf each time the wall has moved so far": "墙每移动这么远一帧 .dat 和 .vtkhdf",
    "a vector picture each time the wall has moved so far": "墙每移动这么远一幅矢量图",
    "a restart file .sav each time the wall has moved so far": "墙每移动这么远一个重启文件 .sav",
    "a .vtk file each time the wall has moved so far": "墙每移动这么远一个 .vtk 文件",
    "number of the history": "监测的编号",
    "steps between two records": "两次记录之间的步数",
    "record the kinetic energy": "记录动能",
    "record the time": "记录时间",
    "record the unbalanced force over the mean contact force": "记录不平衡力与平均接触力之比",
    "record the number of contacts that touch": "记录相互接触的接触数",
    "record the number of bonds": "记录胶结数",
    "record the number of the step": "记录步数",
    "record the kinetic and elastic energy": "记录动能与弹性能",
    "record the axial stress [Pa] on an end wall made of the particles of a group: force of all others on it, over "
    "its width and SET thickness; the axis is across the row":
    "记录由一组颗粒构成的端墙上的轴向应力 [Pa]:其他颗粒对它的力除以其宽度和 SET thickness;轴向垂直于这一排",
    "record (D0 - D) / D0, D the distance of the mean positions of two groups along the axis in which they are "
    "farther apart, D0 that at the HIST command":
    "记录 (D0 - D) / D0,D 为两组平均位置沿相距较远的轴的距离,D0 为 HIST 命令时的值",
    "the wall of xstress, ystress": "xstress、ystress 的墙",
    "record the force in x of the particles on a wall, over its height and SET thickness [Pa]":
    "记录颗粒对墙的 x 方向力除以墙高和 SET thickness [Pa]",
    "record the force in y of the particles on a wall, over its width and SET thickness [Pa]":
    "记录颗粒对墙的 y 方向力除以墙宽和 SET thickness [Pa]",
    "record (D0 - D) / D0, D the distance of the middles of two walls in x":
    "记录 (D0 - D) / D0,D 为两墙中点在 x 方向的距离",
    "record (D0 - D) / D0, D the distance of the middles of two walls in y":
    "记录 (D0 - D) / D0,D 为两墙中点在 y 方向的距离",
    "histories are all that can be plotted; the word may be left out": "只有监测量可以绘图;此词可省略",
    "history on the x axis": "x 轴的监测量",
    "history on the y axis": "y 轴的监测量",
    "steps between two drawings": "两次绘图之间的步数",
    "particles filled, not as circles": "颗粒填充,而不是圆圈",
    "outlines of particles": "颗粒的轮廓",
    "walls": "墙",
    "bonds": "胶结",
    "ids": "编号",
    "rotations": "转动",
    "search cells": "搜索网格",
    "contact forces": "接触力",
    "centres with a <= x < b": "圆心 a <= x < b",
    "centres with a <= y < b": "圆心 a <= y < b",
    "centres inside a quadrilateral, corners in order (even-odd rule)": "圆心在四边形内,角点按顺序(奇偶规则)",
    "centres with (x-x0)^2/a^2 + (y-y0)^2/b^2 <= 1": "圆心 (x-x0)^2/a^2 + (y-y0)^2/b^2 <= 1",
    "particles of a group": "某个组的颗粒",
    "particles with first <= id <= last": "编号 first <= id <= last 的颗粒",
    "both; also where two terms follow each other without a word": "两者都满足;两项之间不写词时也如此",
    "either": "满足其一",
}  # fmt: skip
"""Meanings of keywords of ZDEM by their English."""

PCDC_KEYWORDS = {
    "elements that are hidden, and what belongs to them, are chosen too": "也包括隐藏的单元及其所属对象",
    "of its sides, about": "边长(约)",
    "of the disc, of any length": "圆盘的法向,长度任意",
    "along the axes, not 0": "沿各坐标轴,不为 0",
    "names of layers": "几何层的名称",
    "where to": "移到何处",
    "names of the layers": "各几何层的名称",
    "name of the file, in the folder of the results": "文件名,在结果目录中",
    "along the axes, above 0": "沿各轴,大于 0",
    "the corner": "角点",
    "end of its first edge": "第一条边的端点",
    "of the second": "第二条边的端点",
    "of the third": "第三条边的端点",
    "elements along each edge": "每条边上的单元数",
    "along each edge an element is so many times as large as the one before": "沿每条边,后一单元是前一单元的多少倍",
    "triangles, or tetrahedra; off: quads, or hexahedra": "三角形(四面体);off:四边形(六面体)",
    "layers of geometry": "几何层",
    "a circle": "圆",
    "an arc, counter-clockwise": "圆弧,逆时针",
    "bounds the mesh": "网格的边界",
    "lines that become edges": "成为网格边的线",
    "points of the mesh": "成为网格节点的点",
    "of pieces without one, and away from them": "未给尺寸的部分及远处的尺寸",
    "corners of the outline; or a list of vectors": "外轮廓的角点,或向量列表",
    "corners of a line in it": "内部线的角点",
    "centre of both circles": "两圆的中心",
    "outer radius": "外半径",
    "radius of the hole": "孔的半径",
    "1: halved along x, along y; 0: not": "1:沿 x、沿 y 对分;0:不分",
    "of sides along x and y; one number for both": "沿 x 和 y 的边长;一个数为两者",
    "whether they are": "是否",
    "whether they touch others": "是否与其他单元接触",
    "layer of the water line, in three dimensions of planes and polygons": "水位线所在几何层,三维中为平面和多边形",
    "of the water; 0: there is none any more": "水的密度;0:不再有水",
    "exponent of the overlap of its surfaces while they part, where they have no contact model; above 1 contacts lose energy": "没有接触模型的面在分离时重叠的指数;大于 1 时接触耗能",
    "shear stress along the surface, counter-clockwise about the body": "沿面的剪应力,绕物体逆时针",
    "the same along the surface, counter-clockwise about the body": "同上,沿面,绕物体逆时针",
    "part, from 0 to 1": "比例,0 到 1",
    "head": "头部",
    "end": "末端",
    "length of its elements, at most": "单元长度的上限",
    "it bounds the mesh: what is outside is cut off": "它是网格的边界:外面的被切掉",
    "its centre": "中心",
    "its radius": "半径",
    "where it begins": "起点",
    "where it ends": "终点",
    "points; or a list of vectors": "点,或向量列表",
    "elements inside; off: a hole": "内部有单元;off:为孔",
    "x from ... to ..., or at one number, in the mesh": "x 从 … 到 …,或等于一个数,在网格中",
    "y from ... to ..., or at one number, in the mesh": "y 从 … 到 …,或等于一个数,在网格中",
    "z from ... to ..., or at one number, in the mesh": "z 从 … 到 …,或等于一个数,在网格中",
    "elements with an area, in space faces, from ... to ...": "面积从 … 到 … 的单元,三维中为面",
    "the term that follows does not hold": "后面的一项不成立",
    "all its points lie in the circle, in space the sphere, about a centre and of a radius; elements: their centre; in the mesh": "所有点位于圆内(三维为球内);单元按中心;在网格中",
    "lies along the lines of the layer: within a distance of them and at an angle to them; elements and nodes by the distance; in the mesh": "沿几何层的线:距离和夹角在范围内;单元和节点只看距离;在网格中",
    "all its points are near the lines, in space the surfaces, of the layer; elements: their centre; in the mesh": "所有点靠近几何层的线(三维为面);单元按中心;在网格中",
    "a ray from its middle crosses the lines of the layer an odd or an even number of times, as count is, and at least so often: with 1 what is inside; in the mesh": "从中点出的射线与几何层的线相交次数与 count 同为奇数或偶数,且不少于它:1 为内部;在网格中",
    "faces or nodes of the element, or of those from first to last; without a number of any": "该单元(或编号从…到…的单元)的面或节点;不写编号为任意单元",
    "the centre": "中心",
    "the radius": "半径",
    "distance of its points at most": "各点距离的上限",
    "angle at most": "夹角的上限",
    "distance at most": "距离的上限",
    "of the ray": "射线的方向",
    "crossings": "相交次数",
    "on: joints that are whole are no contacts besides; nothing else is there, so off is refused": "on:完好的节理不另作接触;只有这一种,off 被拒绝",
    "as model creep": "同 model creep",
    "as the word value": "同 value",
    "the time step itself; 0: estimated again; a table over the time is looked at every 100 steps": "时间步本身;0:重新估计;随时间变化的表每 100 步取一次",
    "with auto: steps after which it is estimated again": "与 auto 同用:重新估计的步数",
    "as model run-time, for this command alone": "同 model run-time,只用于本命令",
    "0: no end any more": "0:不再限制",
    "in static runs 50, in dynamic ones 100 without this command": "没有此命令时静力 50,动力 100",
    "of the blocks": "块体",
    "of heat": "热",
    "of fluid": "流体",
    "of proppant, which has the clock of the fluid": "支撑剂,与流体同一时钟",
    "steps": "步数",
    "whether it is": "是否",
    "by a tree of boxes": "用包围盒树",
    "along an axis": "沿一个轴",
    "by cells": "按格子",
    "by cells, too": "同样按格子",
    "between broken faces": "断开的面之间",
    "over the overlap": "按重叠",
    "step by step": "逐步",
    "stress along the normal, which enters as a wave of half its size": "法向应力,以其一半大小的波进入",
    "only this condition": "只取消这一种条件",
    "level of water that stands at the nodes, against gravity, or a point of its surface: hydrostatic pressure below "
    "it; above it water can leave (seepage)":
    "节点处的水位(逆重力方向),或水面上的一点:其下为静水压力,其上水可以渗出",
    "velocity along x; the other components stay": "沿 x 的速度,其他分量不变",
    "velocity along y; the other components stay": "沿 y 的速度,其他分量不变",
    "velocity along z; the other components stay": "沿 z 的速度,其他分量不变",
    "force along x on each node from now on, as the force condition": "此后每个节点沿 x 的力,同力边界条件",
    "force along y on each node from now on, as the force condition": "此后每个节点沿 y 的力,同力边界条件",
    "force along z on each node from now on, as the force condition": "此后每个节点沿 z 的力,同力边界条件",
    "temperature, of the fluid at them too": "温度,也是其处流体的温度",
    "of the fluid alone": "仅流体的温度",
    "time and value, in turn": "时间和值,依次成对",
    "what its times count from": "时间的起点",
    "of what": "对象",
    "draws it again": "重画",
    "time step": "时间步",
    "steps in a cycle": "一个循环中的步数",
    "time from which model run-time counts": "model run-time 的起算时间",
    "what the clock shows now": "时钟现在的时间",
    "its clock": "其时钟",
    "the moment at which a condition takes it": "边界条件采用它的时刻",
    "the beginning of the model": "模型的开始",
    "elements": "单元",
    "joints": "节理",
    "layers": "几何层",
    "bolts": "锚杆",
    "channels": "通道",
    "dimensions of space; in three not everything is there, see the end of the reference":
    "空间维数;三维中并非全部功能都有,见页末的“三维”",
    "name of the file, beside the script": "文件名,位于脚本旁",
    "name of the file": "文件名",
    "acceleration": "加速度",
    "SI, mm-MPa-s, km-MPa-s": "SI、mm-MPa-s 或 km-MPa-s",
    "true motion in time; off: static, towards equilibrium": "随真实时间的动力计算;off:静力计算,趋于平衡",
    "contact of surfaces": "表面之间的接触",
    "of bodies that overlap before the first step: refuse it, with the places; let a static stage move them apart; "
    "or start as they are":
    "第一步之前物体已重叠时:refuse 拒绝并报出位置;relax 由静力计算阶段使其分开;keep 照原样开始",
    "of bodies that come to overlap by more than a tenth of an altitude of an element: say where, or end the run there":
    "计算中物体重叠超过单元高度的十分之一时:warn 报出位置;stop 在该处终止计算",
    "what contact presses with: the distance to the nearest side of an element over the usual altitude in its body, "
    "or four times the smallest of its barycentric coordinates":
    "接触的势函数:到单元最近一边的距离与其物体中单元典型高之比,或最小面积坐标的 4 倍",
    "motion of blocks; off: they stand still while fluid or heat flows":
    "块体的运动;off:块体不动,只计算渗流或传热",
    "rotations of elements are taken into account": "考虑单元的转动",
    "keep the energy budget from here on, in dynamic runs: `pcdc.energies`, histories of the model, a table at the "
    "end":
    "动力计算中从此统计能量平衡:`pcdc.energies`、模型的监测量和结束时的平衡表",
    "flow of fluid in joints that have a hydraulic model; off: pressures stay as they are and go on pushing, so that "
    "blocks come to rest at them": "流体在有渗流模型的节理中流动;off:压力保持不变并继续作用于岩块,可在此压力下求静力平衡",
    "fluid follows the blocks, but does not push on them": "单向耦合:流体随块体变化,但不对块体施加压力",
    "heat flows in elements that have a thermal model; off: temperatures, and the stress that they bring, stay as "
    "they are":
    "热在有热模型的单元中传导;off:温度及其引起的应力保持不变",
    "grains move in the fluid of channels that carry them; off: they stay where they are":
    "支撑剂颗粒随通道中的流体运移;off:颗粒停在原处",
    "on: estimated again every 100 steps; off: at the first step and after changes of the model only; a value stays":
    "on:每 100 步重新估算;off:只在第一步和模型改变后估算;已给定的值不变",
    "part of the stability limit that is taken, by estimates and mass-scaling":
    "估算和质量缩放所取的稳定极限的比例(安全系数)",
    "nodes get as much mass as this time step needs; 0: none, and the step is estimated again":
    "质量缩放:增大节点质量,使此时间步稳定;0:不缩放,并重新估算时间步",
    "sub-step of flow, which then has a clock of its own; 0: those of a cycle take the time of the steps of the "
    "blocks, or without motion half of what is stable":
    "渗流的子步长,此时渗流单独计时;0:一个循环的子步合计等于块体各步的时间,块体不动时取稳定步长的一半",
    "sub-step of heat, which then has a clock of its own; 0: those of a cycle take the time of the steps of the "
    "blocks, or without motion 0.9 of what is stable":
    "传热的子步长,此时传热单独计时;0:一个循环的子步合计等于块体各步的时间,块体不动时取稳定步长的 0.9",
    "number of steps": "步数",
    "unbalanced over all forces of the nodes; with elastic: 1e-8, and as far below as rounding allows":
    "节点不平衡力与全部节点力之比;elastic 时为 1e-8,并尽量降到舍入误差所允许的程度",
    "steps; with elastic: units of time (1) for which prescribed velocities act":
    "步数;elastic 时:给定速度作用多少个单位时间(1)",
    "time that passes; in static runs creep time, each creep step to its ratio (1e-5), or with elastic at once":
    "经过的时间;静力计算中为蠕变时间,每个蠕变步计算到其 ratio(1e-5),elastic 时直接求解",
    "towards a ratio: it has failed when the least ratio has not fallen by a tenth in so many steps, nor in as many "
    "as the progress so far took; 0: never":
    "以 ratio 为目标时:若最小比值在这么多步内、且在与此前进展同样多的步内都没有降低十分之一,即为失败;0:从不",
    "towards a ratio: it has failed after so many steps; 0: never": "以 ratio 为目标时:超过这么多步即为失败;0:从不",
    "stop: with exit code 3; continue: with a warning, the script looks at pcdc.solved":
    "失败时:stop 停止,退出码 3;continue 警告后继续,脚本自行查看 pcdc.solved",
    "at once, without steps": "直接求解,不逐步计算",
    "flow by implicit steps, backward Euler, for so much time or until it is steady; in static runs blocks are in "
    "equilibrium at the end of each step, and joints may pass their peak and break; with mechanical off, flow alone":
    "渗流按隐式步(后向 Euler)计算给定的时间或到稳态;静力计算中每步结束时块体处于平衡,节理可越过峰值并断开;"
    "mechanical off 时只计算渗流",
    "heat by implicit steps, backward Euler, for so much time or to its steady state at once; in static runs blocks "
    "are in equilibrium at the end of each step, and joints may pass their peak and break; with mechanical off, "
    "heat alone":
    "传热按隐式步(后向 Euler)计算给定的时间,或直接求稳态;静力计算中每步结束时块体处于平衡,节理可越过峰值并断开;"
    "mechanical off 时只计算传热",
    "with hydraulic or thermal: longest time step; those of flow are shorter where joints break or no balance is "
    "found":
    "用于 hydraulic 或 thermal:最大时间步;节理断开或求不到平衡时,渗流的时间步会缩短",
    "with hydraulic and time: by explicit steps, as without the word hydraulic, where an estimate says that these "
    "cost less, or where implicit ones are refused; the log has both estimates":
    "用于 hydraulic 和 time:估算显式步更省时,或不能用隐式步时,改用显式步(同不写 hydraulic);日志给出两个估算",
    "with hydraulic or thermal: until as much flows out as in; no time passes":
    "用于 hydraulic 或 thermal:求稳态,流出等于流入;不经过时间",
    "with elastic, hydraulic or thermal: SciPy on one rank, the same bits on any number of ranks; PETSc on all; "
    "auto: PETSc, if it is there, from 400 000 unknowns on, in space from 20 000":
    "用于 elastic、hydraulic 或 thermal:direct 为一个进程上的 SciPy,结果与进程数无关、逐位相同;petsc 用全部进程;"
    "auto:未知数达 400 000(三维 20 000)且装有 PETSc 时用 PETSc",
    "with elastic: what is new in the loads is brought on in so many equal increments, in each of which elements "
    "flow once; one that finds no balance is halved":
    "用于 elastic:新增的荷载分这么多等份施加,每份中单元塑性流动一次;求不到平衡的一份再减半",
    "steps of the blocks between two cycles of flow, and of heat": "两次渗流(传热)循环之间块体的步数",
    "sub-steps of a cycle of heat; 0: as many as are stable, and where heat is that slow, without fluid or friction, "
    "a cycle every ten steps of blocks in motion":
    "一个传热循环的子步数;0:稳定所需的步数;传热足够慢且没有流体和摩擦时,运动的块体每十步一个循环",
    "sub-steps of a cycle of flow; 0: as many as are stable": "一个渗流循环的子步数;0:稳定所需的步数",
    "part of the critical damping at the frequency; 0: none any more": "在此频率处的阻尼比(占临界阻尼的比例);0:取消",
    "where the ratio is this; with both parts it is least there": "阻尼比取此值处的频率;两部分都用时阻尼比在此最小",
    "both, or one of them alone": "质量和刚度两部分都用,或只用其一",
    "whether they creep": "是否蠕变",
    "creep step of static runs; with change the first one": "静力计算的蠕变步长;给出 change 时为第一步的步长",
    "the creep step follows this change of stress: the largest of the deviators of elements and of their Kelvin "
    "dashpots in a creep step, over the largest deviator of all; from one to the next it halves or doubles at most":
    "蠕变步长按此应力变化调整:一个蠕变步内单元及其 Kelvin 黏壶偏应力变化的最大值,与全部单元最大偏应力之比;"
    "相邻两步最多减半或加倍",
    "with change: shortest creep step": "用于 change:最小蠕变步长",
    "with change: longest creep step": "用于 change:最大蠕变步长",
    "the points; or a list of vectors": "各点;或一个向量列表",
    "name of the layer; a layer may hold several shapes": "图层名;一个图层可有多个图形",
    "the corners": "各角点",
    "a corner": "一个角点",
    "the corner across": "对角点",
    "centre": "中心",
    "radius": "半径",
    "first angle": "起始角",
    "last angle": "终止角",
    "the points": "各点",
    "distribution and mean of the angle to x, counter-clockwise; in three dimensions fixed or fisher, and the dip":
    "与 x 轴夹角(逆时针)的分布和平均值;三维中为 fixed 或 fisher,以及倾角",
    "uniform: half width; normal: standard deviation [degrees]; fisher: kappa":
    "uniform:半宽;normal:标准差 [度];fisher:kappa",
    "dip direction, clockwise from y as seen from above": "倾向,俯视时自 y 轴顺时针",
    "distribution of the length, and its value: the length, the mean, the mean, the exponent":
    "长度的分布及其值:依次为长度、平均值、平均值、指数",
    "lognormal: standard deviation": "lognormal:标准差",
    "no shorter ones": "下限:没有更小的",
    "no longer ones": "上限:没有更大的",
    "the same of the radius of discs": "圆盘裂隙的半径,同上",
    "density: fractures per length of a scan line": "密度:测线单位长度上的裂隙数",
    "density: fractures per area": "密度:单位面积内的裂隙数",
    "density: length of fractures per area": "密度:单位面积内的裂隙长度",
    "density: fractures per volume": "密度:单位体积内的裂隙数",
    "density: area of fractures per volume": "密度:单位体积内的裂隙面积",
    "direction of the line of p10": "p10 测线的方向",
    "p20 or p21, p30 or p32 is met as nearly as whole ones can, not in the mean":
    "用整条裂隙尽量达到 p20 或 p21、p30 或 p32,而不只是平均达到",
    "share of the crossings with earlier fractures at which one ends": "与先前裂隙相交时终止于该裂隙的比例",
    "the layer that bounds them": "裂隙限于此图层之内",
    "none inside of this layer": "此图层之内没有裂隙",
    "shorter pieces at the rim are left out": "边缘处更短的裂隙段舍去",
    "another seed, another network": "随机种子:种子不同,裂隙网络不同",
    "middle of one end": "一端的中心",
    "of the other": "另一端的中心",
    "radius at the first end": "第一端的半径",
    "radius at the other": "另一端的半径",
    "normal of any length": "法向,长度任意",
    "a point of it": "其上一点",
    "of polygons": "多边形所在的图层",
    "the way": "拉伸的路径",
    "direction of the axis": "轴的方向",
    "right-handed, up to 360": "转角,右手方向,最大 360",
    "only this layer of the file": "只导入文件中的此图层",
    "name of the layer": "图层名",
    "done first": "缩放倍数,最先进行",
    "then, counter-clockwise; in three dimensions right-handed about an axis": "旋转角,其次进行,逆时针;三维中绕轴按右手定则",
    "about which it is turned": "旋转轴",
    "centre of both": "缩放和旋转的中心",
    "last": "平移,最后进行",
    "its outline": "剖分区域的轮廓",
    "length of edges": "单元边长",
    "smaller elements near this layer": "此图层附近网格加密",
    "length of edges there": "加密处的单元边长",
    "over which the size grows to that of the rest": "单元边长过渡到其余部分的距离",
    "what is inside of this layer stays empty": "此图层之内为空(孔洞)",
    "what is inside of this layer is a group of its own": "此图层之内单独成组",
    "its name": "组名",
    "lines that become edges of the mesh; in three dimensions surfaces, which become faces":
    "成为网格边的线;三维中为成为单元面的面",
    "lines that become edges with a crack from the beginning; in three dimensions surfaces":
    "成为网格边且一开始就是裂纹的线;三维中为面",
    "each body of the layer is a group of its own: by its name in its file, else by the layer and its number":
    "图层中每个物体单独成组:用文件中的名称,否则用图层名加编号",
    "triangles or quads": "三角形或四边形",
    "triangles in no pattern: rows of equilateral ones lead cracks": "不规则的三角形:成排的等边三角形会引导裂纹",
    "inner points lie in the middle of their neighbours, so that joints on all edges share a uniform stress evenly; "
    "for triangles":
    "内部节点位于相邻节点的中心,使各边上的节理均匀分担均匀应力;用于三角形",
    "the group that the new elements are in": "新单元所在的组",
    "the set of the group": "组所属的集",
    "along x and y, in three dimensions z": "沿 x、y(三维还有 z)的单元格数",
    "tetrahedra of each box: 5, mirrored from box to box, 6 about a diagonal, or 12 about a point in the middle":
    "每个长方体分成的四面体:5 个(相邻长方体互为镜像)、6 个(绕一条对角线)或 12 个(绕中心点)",
    "triangles or quads, in three dimensions tetrahedra or hexahedra": "三角形或四边形,三维中为四面体或六面体",
    "of the triangles; alternating, or both of each rectangle": "三角形的对角线方向;alternate 为交替,both 为每个矩形用两条",
    "along x and y (and z): each rectangle or box is so many times as large as the one before":
    "沿 x、y(和 z):每个矩形(长方体)的尺寸是前一个的多少倍",
    "a group that all elements are put into, besides those of the file": "除文件中的组外,全部单元再放入此组",
    "points nearer than this are one": "距离小于此值的点合并为一点",
    "metres in a unit of the file": "文件中一个长度单位等于多少米",
    "its lines are edges of the mesh, its surfaces faces": "图层中的线是网格的边,面是单元面",
    "they are not: the edges that follow them best are taken, the faces between elements on either side":
    "图层不在网格边上时:取最贴近的网格边,即两侧单元之间的面",
    "only faces between the elements of these two groups": "只用这两组单元之间的面",
    "name of the group": "组名",
    "density": "密度",
    "Young's modulus E": "杨氏模量 E",
    "Poisson's ratio": "泊松比",
    "shear modulus, with the bulk modulus in the place of E and Poisson's ratio":
    "剪切模量,与体积模量一起代替 E 和泊松比",
    "bulk modulus, with the shear modulus in the place of E and Poisson's ratio":
    "体积模量,与剪切模量一起代替 E 和泊松比",
    "viscous damping, part of the critical 2 L sqrt(rho E); without effect in static runs":
    "黏性阻尼,占临界值 2 L sqrt(rho E) 的比例;静力计算中不起作用",
    "friction angle of its surfaces where they have no contact model": "表面没有接触模型时的摩擦角",
    "contact penalty of its surfaces where they have no contact model; 0: that of its joints, or 10 E":
    "表面没有接触模型时的接触罚参数;0:取其节理的值,或 10 E",
    "what they did to the others dies down over this time (static runs: so many steps)":
    "移去的单元对其余单元的作用力在此时间内(静力计算:这么多步内)逐渐释放",
    "internal friction angle; also that of its surfaces where they have no contact model":
    "内摩擦角;表面没有接触模型时也是其摩擦角",
    "cohesion": "黏聚力",
    "tensile strength; no more than cohesion / tan(friction) counts": "抗拉强度;最大取 cohesion / tan(friction)",
    "dilation angle, at most the friction angle": "剪胀角,不大于内摩擦角",
    "a property that the law declares, by its name, and its value": "本构所声明的参数的名称和值",
    "bulk modulus; in the place of the one that E and Poisson's ratio give": "体积模量;代替由 E 和泊松比得出的值",
    "shear modulus of the Kelvin unit; 0: no Kelvin unit": "Kelvin 体的剪切模量;0:没有 Kelvin 体",
    "viscosity of the Kelvin unit; 0: no Kelvin unit": "Kelvin 体的黏度;0:没有 Kelvin 体",
    "shear modulus of the Maxwell unit; in the place of the one that E and Poisson's ratio give":
    "Maxwell 体的剪切模量;代替由 E 和泊松比得出的值",
    "viscosity of the Maxwell unit; 0: no dashpot": "Maxwell 体的黏度;0:没有黏壶",
    "strain xx of the Kelvin unit at that moment; its zz is -xx - yy": "此刻 Kelvin 体的应变 xx;其 zz 为 -xx - yy",
    "strain yy of the Kelvin unit at that moment; its zz is -xx - yy": "此刻 Kelvin 体的应变 yy;其 zz 为 -xx - yy",
    "strain xy of the Kelvin unit at that moment; its zz is -xx - yy": "此刻 Kelvin 体的应变 xy;其 zz 为 -xx - yy",
    "strain zz of the Kelvin unit at that moment, to be said of all three": "此刻 Kelvin 体的应变 zz,供写明全部三个正应变时用",
    "strain xz of the Kelvin unit at that moment": "此刻 Kelvin 体的应变 xz",
    "strain yz of the Kelvin unit at that moment": "此刻 Kelvin 体的应变 yz",
    "thermal conductivity": "导热系数",
    "specific heat": "比热容",
    "heat transfer at faces: to an environment that is prescribed on them without a coefficient of its own, and to "
    "surfaces that they touch, with the harmonic mean of both":
    "单元面的换热系数:用于面上给定环境温度而未给换热系数时,以及与所接触的表面换热(取两者的调和平均)",
    "linear thermal expansion": "线膨胀系数",
    "conductivity across the direction of conductivity-angle": "垂直于 conductivity-angle 方向的导热系数",
    "direction of conductivity from x, counter-clockwise, in space the strike of the planes along which it is; it "
    "turns with the element":
    "conductivity 的方向,自 x 轴逆时针,三维中为导热面的走向;随单元转动",
    "how much of its share of the work of friction an element takes as heat where its faces slide on others":
    "单元面与其他面滑动时,单元所分担的摩擦功转化为热的比例",
    "dip of these planes": "导热面的倾角",
    "'file.py:law': the file, beside the script, and the name of the law in it; plain text":
    "'file.py:law':脚本旁的文件及其中本构的名称;须为普通文本",
    "friction angle of its surfaces where they have no contact model; the internal one of mechanical-mohr-coulomb":
    "表面没有接触模型时的摩擦角;对 mechanical-mohr-coulomb 为内摩擦角",
    "stress xx": "应力 xx",
    "is added: its product with the position": "梯度:再加上它与坐标的乘积",
    "stress yy": "应力 yy",
    "stress xy": "应力 xy",
    "stress zz": "应力 zz",
    "stress xz": "应力 xz",
    "stress yz": "应力 yz",
    "friction angle": "摩擦角",
    "normal penalty; 10 to 100 E is usual": "法向罚参数;一般为 10 到 100 E",
    "shear penalty": "切向罚参数",
    "largest normal stress while surfaces approach; contacts that reach it lose energy":
    "表面接近时法向应力的上限;达到它的接触损失能量",
    "exponent of the overlap while surfaces part; above 1 contacts lose energy":
    "表面分离时重叠量的指数;大于 1 时接触损失能量",
    "normal dashpot, part of the critical damping of two elements; the larger of two surfaces counts; without effect "
    "in static runs":
    "法向黏壶,占两单元临界阻尼的比例;取两个表面中较大的值;静力计算中不起作用",
    "stress along the normal, which turns with the surface; negative is pressure": "沿法向的应力,法向随表面转动;负为压力",
    "dashpots rho c_p and rho c_s, through which waves leave in dynamic runs; a stress given beside it enters as a "
    "wave of half its size":
    "黏性(吸收)边界:黏壶 rho c_p 和 rho c_s,动力计算中波由此传出;同时给出的应力作为其一半大小的波传入",
    "velocity along x of a plane wave that comes in through quiet faces": "由黏性边界传入的平面波沿 x 的速度",
    "the same along y": "沿 y,同上",
    "the same along z": "沿 z,同上",
    "heat that comes in": "流入的热流密度",
    "heat transfer to the environment": "与环境的换热系数",
    "temperature of the environment": "环境温度",
    "cohesion; 0: friction alone": "黏聚力;0:只有摩擦",
    "tensile strength; 0: none": "抗拉强度;0:没有",
    "fracture energy, mode I": "I 型断裂能",
    "fracture energy, mode II": "II 型断裂能",
    "penalty of a closed joint": "闭合节理的罚参数",
    "penalty of opening": "张开的罚参数",
    "penalty of shear": "剪切的罚参数",
    "integration points": "积分点数",
    "density of the fluid": "流体密度",
    "bulk modulus of the fluid": "流体的体积模量",
    "kinematic viscosity of the fluid: the dynamic one over the density": "流体的运动黏度:动力黏度除以密度",
    "hydraulic aperture of a joint that is not opened; of joints that are not broken a virtual one, which stands for "
    "the permeability of the rock":
    "未张开节理的水力开度;未断节理的是虚拟开度,代表岩石的渗透性",
    "smallest hydraulic aperture, of joints that are pressed together": "最小水力开度,用于受压闭合的节理",
    "largest hydraulic aperture": "最大水力开度",
    "broken joints lose fluid to the rock after Carter": "断开的节理按 Carter 模型向岩石滤失流体",
    "leak-off: pressure in the pores of the rock; negative: suction of rock that is not saturated":
    "滤失:岩石的孔隙压力;负值:非饱和岩石的吸力",
    "leak-off: permeability of the rock": "滤失:岩石的渗透率",
    "leak-off: compressibility of the pores": "滤失:孔隙压缩系数",
    "leak-off: porosity of the rock": "滤失:岩石的孔隙度",
    "the aperture grows by the tangent of this angle times the mean slip of the joint":
    "剪胀角:开度增加其正切与节理平均滑移量之积",
    "what slip adds to the aperture at most": "滑移使开度增加的最大值",
    "leak-off: part of the pores that was full before; below 1 a sharp front fills the rest":
    "滤失:岩石的初始饱和度;小于 1 时其余孔隙由陡峭的湿润锋面充满",
    "fast flow is turbulent, with the friction of smooth walls after Blasius; else laminar at any Reynolds number":
    "流速较高时按紊流计算,采用 Blasius 光滑壁摩阻;否则任何雷诺数下均按层流计算",
    "density of the grains": "支撑剂颗粒的密度",
    "diameter of the grains": "支撑剂颗粒的直径",
    "channels narrower than so many grains carry none: they bridge": "宽度小于这么多个粒径的通道不携带颗粒:发生桥堵",
    "hydraulic aperture of a pack over that of the channel; 0: permeability of the pack after Kozeny and Carman":
    "支撑剂充填层的水力开度与通道开度之比;0:充填层的渗透率按 Kozeny–Carman 公式",
    "concentration of a pack": "充填层的浓度(极限浓度)",
    "modulus of a pack that is pressed together; 0: it bears nothing": "受压充填层的模量;0:不承受压力",
    "beta of the slurry, whose viscosity is that of the fluid times (1 - C / limit)^beta":
    "携砂液黏度公式的 beta:黏度为流体黏度乘以 (1 - C / limit)^beta",
    "settling after Stokes; else after Schiller and Naumann, for any Reynolds number":
    "按 Stokes 公式沉降;否则按 Schiller–Naumann 公式,适用于任何雷诺数",
    "thermal conductivity of the fluid": "流体的导热系数",
    "specific heat of the fluid": "流体的比热容",
    "heat transfer between fluid and each of the two sides": "流体与两壁各自之间的换热系数",
    "advection of second order with a flux limiter: fronts stay sharper": "带通量限制器的二阶对流格式:锋面更清晰",
    "velocity along x": "沿 x 的速度",
    "velocity along y": "沿 y 的速度",
    "velocity along z": "沿 z 的速度",
    "acceleration along x": "沿 x 的加速度",
    "acceleration along y": "沿 y 的加速度",
    "acceleration along z": "沿 z 的加速度",
    "force along x": "沿 x 的力",
    "force along y": "沿 y 的力",
    "force along z": "沿 z 的力",
    "0 free (takes constraints back), 1 held, 2 moves along the vector only, 3 (in three dimensions) across it only (type "
    "0 and 1 take a vector and do not use it)":
    "0 自由(撤销约束),1 固定,2 只能沿向量运动,3(三维)只能垂直于向量运动(0 和 1 可写向量,但不用)",
    "pressure, not negative": "压力,不为负",
    "volume that comes in at each node; negative: is taken out, as far as there is fluid; in space m3/s":
    "每个节点流入的流量;负值:抽出,以有流体为限;三维中单位为 m3/s",
    "concentration of the slurry that conditions and wells bring: volume of grains over that of the slurry":
    "边界条件和井所注入携砂液的浓度:颗粒体积与携砂液体积之比",
    "volume of grains that comes in at each node, in the slurry that is there; in space m3/s":
    "每个节点随该处携砂液进入的颗粒体积流量;三维中单位为 m3/s",
    "temperature": "温度",
    "'file.py:function', beside the script; plain text": "'file.py:function',文件在脚本旁;须为普通文本",
    "velocity": "速度",
    "temperature, of the fluid at them too; before, it is 0. Elements around the nodes are free of thermal stress "
    "then":
    "温度,该处流体也取此值;此前为 0。此时节点周围的单元没有热应力",
    "filled, at this pressure": "充满,并处于此压力",
    "part of the room that is filled": "饱和度:充有流体的空间的比例",
    "of proppant in the fluid that is there": "该处流体中支撑剂的浓度",
    "name": "名称",
    "volume that is pumped in; negative: drawn, as far as there is fluid; in space m3/s":
    "泵入的流量;负值:抽出,以有流体为限;三维中单位为 m3/s",
    "pressure that is held": "保持的压力",
    "nothing comes in or out": "关井:既不流入也不流出",
    "time of flow that it takes": "此阶段的时间(渗流时间)",
    "with rate: pressure above which less is pumped in": "用于 rate:压力超过此值时减少泵入量",
    "the points, from the head on; or a list of vectors": "各点,从锚头开始;或一个向量列表",
    "elements of each straight part": "每个直线段的单元数",
    "of an element, at most": "单元的最大长度",
    "from where to where along the bolt there is grout; without the rest is free":
    "沿锚杆注浆段的起止位置;其余为自由段",
    "the first node is tied to the rock: a face plate": "第一个节点与岩石固定:托盘",
    "the group that its elements and nodes are put into": "其单元和节点所入的组",
    "diameter of the bar": "杆体直径",
    "axial force at which it yields in tension": "受拉屈服的轴力",
    "axial force, without sign, at which it yields in compression": "受压屈服的轴力,不带符号",
    "lengthening of an element since it was installed, over its length, at which it breaks for good":
    "单元自安装以来的伸长率,达到时永久拉断",
    "force of the grout per length of bolt and displacement": "浆体的剪切刚度:单位锚杆长度、单位位移的力",
    "thickness of the grout around the bar": "杆体周围浆体的厚度",
    "cohesion between rock and grout": "岩石与浆体之间的黏聚力",
    "cohesion between grout and bolt": "浆体与锚杆之间的黏聚力",
    "friction angle between rock and grout": "岩石与浆体之间的摩擦角",
    "friction angle between grout and bolt": "浆体与锚杆之间的摩擦角",
    "from bolt to bolt across the plane": "垂直于计算平面的锚杆间距",
    "tension with which it is installed": "安装时的预拉力",
    "viscous damping of the motion along the bar, part of 2 A sqrt(rho E); without effect in static runs":
    "沿杆体运动的黏性阻尼,占 2 A sqrt(rho E) 的比例;静力计算中不起作用",
    "Poisson's ratio: E / (1 - nu^2) counts in plane strain; 0 for steel sets":
    "泊松比:平面应变中取 E / (1 - nu^2);钢拱架取 0",
    "thickness of the shell; without area and inertia it gives both": "衬砌厚度;不给面积和惯性矩时由它得出两者",
    "area of the section over the spacing of steel sets": "截面面积除以钢拱架间距",
    "second moment of the section over the spacing of steel sets": "截面惯性矩除以钢拱架间距",
    "strength in tension; with compressive_strength": "抗拉强度;与 compressive_strength 一起给出",
    "strength in compression; with tensile_strength": "抗压强度;与 tensile_strength 一起给出",
    "largest moment at the axial force that allows most": "塑性弯矩:最有利轴力下的最大弯矩",
    "stiffness of the bond across the face": "衬砌与岩面黏结的法向刚度",
    "stiffness of the bond along the face; 0: it slips freely": "衬砌与岩面黏结的切向刚度;0:自由滑动",
    "tension at which the bond parts for good": "黏结永久脱开的拉应力",
    "cohesion of the bond, until it parts": "黏结脱开之前的黏聚力",
    "friction angle of the bond, whether it has parted or not": "黏结的摩擦角,脱开前后相同",
    "rate of rotation, counter-clockwise": "转动速度,逆时针",
    "moment, counter-clockwise": "弯矩,逆时针",
    "(time or coordinate, value), the first ascending": "(时间或坐标, 值),前者递增",
    "scale (63 % of the values are below it) and shape": "尺度参数(63 % 的值在其下)和形状参数",
    "mean and standard deviation": "平均值和标准差",
    "mean and standard deviation of the values themselves": "值本身的平均值和标准差",
    "another seed, another field": "随机种子:种子不同,随机场不同",
    "over this length neighbours are alike: the field is one of places, the same in any mesh":
    "相关长度:此长度内的值相近;随机场按位置定义,与网格无关",
    "exp(-r/L), or exp(-(r/L)2), which is smooth": "exp(-r/L),或光滑的 exp(-(r/L)2)",
    "the distribution is cut below": "分布的下限",
    "the distribution is cut above": "分布的上限",
    "what it is a number of": "所记录的对象",
    "the object of this number": "此编号的对象",
    "the object nearest to this point": "距此点最近的对象",
    "what is recorded, see below": "记录的量,见页末的“监测记录的量”",
    "steps between two records": "两次记录之间的步数",
    "with law-state: which state variable of laws of the user": "用于 law-state:用户本构的哪个状态变量",
    "with object well: its name": "对象为井时:井名",
    "of the objects of range, or of all": "对 range 选中的对象,或全部对象",
    "only these": "只导出这些",
    "over the diagram": "图的标题",
    "of the axis": "坐标轴的标签",
    "history along x; without it the time": "x 轴的监测;不给时为时间",
    "history along y": "y 轴的监测",
    "factor": "倍数",
    "points (x,y)": "点 (x,y)",
    "of the fluid as it is now, along the line that the joints of the range make, over the distance [m] from its left "
    "end":
    "流体此刻的量,沿 range 中节理连成的线,对距其左端的距离 [m] 绘出",
    "in the legend": "图例中的名称",
    "how it is drawn": "曲线的画法",
    "name of the figure: .png, .pdf or .svg": "图的文件名:.png、.pdf 或 .svg",
    "beside it the model as it is now, with its cracks by the way they broke":
    "旁边画出模型现状,裂纹按断裂方式着色",
    "beside it the model as it is now, with contours of plastic shear strain": "旁边画出模型现状及塑性剪应变云图",
    "beside it the model as it is now, with contours of temperature, and cracks": "旁边画出模型现状及温度云图和裂纹",
    "beside it the model as it is now, its channels coloured by that": "旁边画出模型现状,通道按此量着色",
    "first part of the names of the files, in the folder of the results": "文件名的前一部分,位于结果目录",
    "steps between two frames": "两帧之间的步数",
    "no more frames of this name": "不再写此名称的帧",
    "first part of the name, in the folder of the results; .pdf, .svg or .png at its end says what is drawn":
    "文件名的前一部分,位于结果目录;末尾的 .pdf、.svg 或 .png 决定图的格式",
    "what is shown, as a file *.mv says, of hpcdem view or hpcdem draw":
    "显示的内容,由 hpcdem view 或 hpcdem draw 的 *.mv 文件给出",
    "what colours objects; hpcdem draw --list names the fields of a frame":
    "给对象着色的物理量;hpcdem draw --list 列出帧中的物理量",
    "of which objects the field and the options below are": "物理量和以下选项所属的对象",
    "values of the first and the last colour": "色标两端的值",
    "in the place of limits: the least and the greatest value of what is shown": "代替 limits:取所示对象的最小值和最大值",
    "colours by the logarithm": "按对数着色",
    "of the field": "物理量的色标",
    "from 0 to 1": "不透明度,0 到 1",
    "outlines of elements": "单元的轮廓",
    "factor on widths of lines": "线宽的倍数",
    "arrows: displacement or velocity": "箭头:位移或速度",
    "factor on their length": "箭头长度的倍数",
    "only objects for which this holds, as 'stress_yy < -1e6 and x > 2'":
    "只画满足此条件的对象,如 'stress_yy < -1e6 and x > 2'",
    "factor on displacements": "位移的放大倍数",
    "lower left and upper right corner of the picture, in space along it and up it":
    "图片的左下角和右上角,三维中沿图片的水平和竖直方向",
    "from where a body is seen: along an axis, from the right, the front and above (iso), or from a direction":
    "视线方向:沿某一坐标轴,从右前上方(iso),或从给定方向",
    "a plane that cuts it: 'x=1.5' takes the part towards the eye away, 'x<1.5' and 'x>1.5' say what stays, "
    "'px,py,pz,nx,ny,nz' gives a point and the normal into what is taken away":
    "剖切面:'x=1.5' 切去靠近视点的部分,'x<1.5' 和 'x>1.5' 指明留下的部分,"
    "'px,py,pz,nx,ny,nz' 给出一点和指向切去部分的法向",
    "over the picture; {step} and {time} are filled in": "图片的标题;{step} 和 {time} 会被代入",
    "members of the group": "组的成员",
    "members of any group of the set": "此集中任一组的成员",
    "the number, or from first to last; numbers begin at 0, as in the output": "编号,或从首号到末号;编号从 0 开始,与输出相同",
    "lies on the lines, in three dimensions on the surfaces, of the geometry layer; elements: their centre is inside "
    "of it; in the mesh":
    "位于几何图层的线上(三维:面上);单元:中心在图层之内;按网格中的位置",
    "x, y and geometry (of elements) look at where things are at this moment":
    "x、y 和(单元的)geometry 按此刻的位置判断",
    "lies on a surface of the model": "位于模型的表面",
    "faces, joints or nodes of the elements of the group; joints: both elements are in it; nodes: where elements may "
    "part, on their side": "此组单元的面、节理或节点;节理:两侧单元都在组中;节点:在单元可能分开之处,取本侧的节点",
    "joints with an element of each of the two groups": "两侧单元分属这两组的节理",
    "joints on a crack of the mesh": "网格裂纹上的节理",
}  # fmt: skip
"""Meanings of keywords of PCDC, and of their properties, by their English."""

PCDC_DEFAULTS = {
    "as STEP and DXF files say, else 1": "按 STEP、DXF 文件所写,否则为 1",
    "static runs: ten times as many as a wave takes there and back, at least 20 000; dynamic ones, and beside cycles "
    "or time: 0":
    "静力计算:波往返所需步数的十倍,至少 20 000;动力计算,或同时给出 cycles、time 时:0",
    "static runs 1 000 000, dynamic ones 10 000 000; beside time: 0":
    "静力计算 1 000 000,动力计算 10 000 000;同时给出 time 时:0",
    "a hundredth of the time": "时间的百分之一",
    "dt stays": "dt 不变",
    "none": "无",
    "all": "全部",
    "ten times the size": "边长的十倍",
    "the name of the layer": "图层名",
    "a thousandth of the shortest edge": "最短边的千分之一",
    "at once": "立即",
    "the normal penalty": "同法向罚参数",
    "never": "从不",
    "that of the elements": "同单元",
    "that of opening": "同张开",
    "no limit": "无限制",
    "needed by leak-off": "leak-off 时必需",
    "no end": "不结束",
    "to the edges of the elements of the mesh": "以网格单元的边分段",
    "all of it": "全长",
    "that in tension": "同受拉",
    "that of a rectangle of this area and inertia": "此面积和惯性矩的矩形的厚度",
    "the thickness": "同厚度",
    "that of a rectangle": "矩形截面的值",
    "never slips": "不滑动",
    "each object by itself": "各对象独立",
    "time": "时间",
    "once, now": "只写一次,立即",
    "everything": "全部内容",
    "the first that have the field": "最先有此物理量的对象",

    "the model": "整个模型",
    "whole": "不剖切",
}  # fmt: skip
"""Defaults of PCDC that are told in words, by their English."""

FIELDS = {
    "stress": "应力", "principal": "主应力", "displacement": "位移", "velocity": "速度", "acceleration": "加速度",
    "force": "力", "contact_force": "接触力", "nodal_force": "节点力", "axial_force": "轴力", "shear_force": "剪力",
    "bond_force": "粘结力", "reaction": "反力", "moment": "弯矩", "torque": "力矩", "spin": "角速度", "angle": "转角",
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
    "first_node": "起始节点", "last_node": "末端节点", "bolt_state": "锚杆状态", "liner_state": "衬砌状态",
    "bond_state": "粘结状态", "bolt": "锚杆", "liner": "衬砌", "host": "所在单元", "fixed": "固定方向",
    "constraint": "约束类型", "quiet": "无反射", "incoming": "入射波", "group": "组", "color": "颜色", "colour": "颜色",
    "material": "材料", "birth": "生成步", "fix": "固定", "clump": "颗粒簇", "members": "成员数", "kind": "类型",
    "bonded": "胶结", "rubber": "橡胶", "hertz": "Hertz 接触", "link": "类别", "ebmod": "法向模量", "gbmod": "切向模量",
    "tstrength": "抗拉强度", "sstrength": "抗剪强度", "fric": "摩擦系数", "shear": "剪切模量", "poiss": "泊松比",
    "kn": "法向刚度", "ks": "切向刚度", "damp": "阻尼", "contact": "接触", "yielded": "屈服", "work": "功",
}  # fmt: skip
"""Fields of frames, by their names without component."""
COMPONENTS = {
    "max": "最大", "middle": "中间", "min": "最小", "mean": "平均", "mises": "Mises", "deviator": "偏", "shear": "剪切",
    "normal": "法向", "first": "起点", "last": "终点", "largest": "最大",
}  # fmt: skip
"""Ends of their names; xx, x and so on stay."""
LEGEND = {
    "tension": "拉裂", "mixed": "拉剪", "shear": "剪裂", "yielded": "屈服", "initial": "初始",
}  # fmt: skip
"""Words of legends: how joints broke."""
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
