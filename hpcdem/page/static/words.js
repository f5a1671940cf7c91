// What the page says, in two languages. Each name is in both; {x} is replaced.

export const WORDS = {
  en: {
    title: "hpcdem grade: from a grading curve to a specimen",
    skip: "Go to the packing",
    subtitle: "from a grading curve to a specimen",
    language: "中文", language_label: "切换到中文", language_code: "zh",
    theme_auto: "Theme: system", theme_light: "Theme: light", theme_dark: "Theme: dark",
    output: "Output", open: "Open file…", open_title: "A text file: size in mm and percent finer, one pair per line",
    grading: "Grading", table_caption: "Grain sizes and percentages finer; numbers of grains and grading reached",
    colour: "Colour", size: "Size", finer: "Finer", reached: "Reached", grains: "Grains", remove: "Remove",
    add: "Add a row", reset: "Undo all changes",
    size_of: "Size of row {row} in mm", finer_of: "Percent finer of row {row}", remove_row: "Remove row {row}",
    need: "from {n}", need_title: "A grain of this size requires {n} grains in total. Click to set this number.",
    specimen: "Specimen", shape: "Shape of the grains",
    circle: "Circle", ellipse: "Ellipse", triangle: "Triangle", quadrilateral: "Quadrilateral", pentagon: "Pentagon",
    number: "Number of grains", slenderness: "Slenderness", void_ratio: "Void ratio", l_over_d: "Axes",
    deviation: "Angle deviation", roundness: "Roundness", seed: "Seed",
    number_unit: "N", slenderness_unit: "H / W", void_ratio_unit: "e", l_over_d_unit: "L / D", deviation_unit: "degrees",
    roundness_unit: "0 straight edges, 1 circle", seed_unit: "random numbers",
    exactly: "{name}, exact value", dice: "New random specimen",
    placement: "Placement", cells: "Loose column", dense: "Dense box",
    curve: "Grading curve", soil: "coarse to the left", target: "target", achieved: "reached",
    x_axis: "Grain size d [mm]", y_axis: "Percent finer by mass [%]",
    plot_label: "Grading curve: percent finer over grain size on a logarithmic axis, target and reached.",
    numbers: "Numbers",
    fact_number: "Grains", fact_of: "of {n}", fact_box: "Box W × H", fact_solid: "Area of the grains",
    fact_void: "Void ratio", fact_void_target: "target {e}", fact_cu: "Cu, reached", fact_cc: "Cc, reached",
    fact_asked: "target {v}", fact_height: "Height of the column", fact_classes: "Sizes with grains",
    fact_need: "N for every size", fact_time: "Time", fact_time_of: "{draw} drawing",
    packing: "Packing", view: "View", fit_box: "Box", fit_all: "All grains", nearer: "Zoom in", farther: "Zoom out",
    keys: "Wheel, + −: zoom · drag, arrows: pan · 0: show the box",
    stale: "The last valid specimen", coarse: "Preview with {n} grains", picture: "{n} grains, {shape}, in a box of {w} × {h} mm",
    tip: "{d} mm · grain {n}",
    row: "Row {row}: {text}", busy: "Computing…", first: "Computing… Kernels are compiled on first use, which takes half a minute.", no_server: "The server does not respond. Has hpcdem ended? ({why})",
    no_file: "This file cannot be read: {why}", bad_file: "{name}: not a grading file, larger than 64 KiB",
    close: "Close", command: "On the command line", copy: "Copy", copied: "Copied",
    not_copied: "The browser does not allow copying; select the text instead.",
    save: "Save", saving: "Making {name}…", saved: "{name}: {size} KiB", all_files: "All files",
    file_specimen: "PPDEM file, central angles (as in the sample of its manual)",
    file_full: "PPDEM file with the roundness of each edge (fields as listed in its manual)",
    file_bodies: "Particles for the solver",
    file_grading: "Grading: target, reached, grains per size",
    file_curve: "Grading curve", file_packing: "Packing", file_histogram: "Histogram of sizes",
    file_plain: "PPDEM file, circles without the leading 1 (fields as listed in its manual)",
    file_deposit: "Script: deposition under gravity", file_biaxial: "Script: biaxial test",
    file_summary: "Request and result (JSON)", file_table: "The table as a grading file",
  },
  zh: {
    title: "hpcdem grade:由级配曲线生成试样",
    skip: "转到颗粒分布图",
    subtitle: "由级配曲线生成试样",
    language: "English", language_label: "Switch to English", language_code: "en",
    theme_auto: "外观:跟随系统", theme_light: "外观:浅色", theme_dark: "外观:深色",
    output: "输出", open: "导入文件…", open_title: "文本文件,每行一条:粒径(mm)和小于该粒径的质量百分比",
    grading: "级配", table_caption: "粒径与小于该粒径的百分比;颗粒数目与实际级配",
    colour: "颜色", size: "粒径", finer: "小于", reached: "实际", grains: "颗粒数", remove: "删除",
    add: "增加一行", reset: "撤销全部修改",
    size_of: "第 {row} 行的粒径(mm)", finer_of: "第 {row} 行小于该粒径的百分比", remove_row: "删除第 {row} 行",
    need: "至少 {n}", need_title: "颗粒总数达到 {n} 时才有一个该粒径的颗粒。单击采用此数目。",
    specimen: "试样", shape: "颗粒形状",
    circle: "圆形", ellipse: "椭圆形", triangle: "三角形", quadrilateral: "四边形", pentagon: "五边形",
    number: "颗粒数目", slenderness: "试样长细比", void_ratio: "预估孔隙比", l_over_d: "长短径比",
    deviation: "角度偏差", roundness: "浑圆度", seed: "随机数种子",
    number_unit: "N", slenderness_unit: "H / W", void_ratio_unit: "e", l_over_d_unit: "L / D", deviation_unit: "度",
    roundness_unit: "0 为直边,1 为圆", seed_unit: "随机数",
    exactly: "{name},精确值", dice: "重新随机生成",
    placement: "排列方式", cells: "松散柱状", dense: "密实填充",
    curve: "级配曲线", soil: "粗粒在左", target: "目标", achieved: "实际",
    x_axis: "粒径 d [mm]", y_axis: "小于某粒径的质量百分数 [%]",
    plot_label: "级配曲线:对数坐标粒径与小于该粒径的质量百分数,目标与实际。",
    numbers: "数值",
    fact_number: "颗粒数", fact_of: "共 {n}", fact_box: "试样 宽 × 高", fact_solid: "颗粒总面积",
    fact_void: "孔隙比", fact_void_target: "预估 {e}", fact_cu: "不均匀系数 Cu", fact_cc: "曲率系数 Cc",
    fact_asked: "目标 {v}", fact_height: "柱高", fact_classes: "有颗粒的粒径",
    fact_need: "各粒径齐全需 N", fact_time: "用时", fact_time_of: "绘图 {draw}",
    packing: "颗粒分布", view: "视图", fit_box: "试样", fit_all: "全部颗粒", nearer: "放大", farther: "缩小",
    keys: "滚轮或 + − 缩放;拖动或方向键平移;按 0 显示试样。",
    stale: "上一个有效试样", coarse: "预览:{n} 个颗粒", picture: "{n} 个颗粒,{shape},试样 {w} × {h} mm",
    tip: "{d} mm · 颗粒 {n}",
    row: "第 {row} 行:{text}", busy: "计算中…", first: "计算中……首次运行需要编译内核,约半分钟。", no_server: "服务器没有响应。hpcdem 是否已结束?({why})",
    no_file: "无法读取该文件:{why}", bad_file: "{name}:超过 64 KiB,不是级配文件",
    close: "关闭", command: "对应的命令行", copy: "复制", copied: "已复制",
    not_copied: "浏览器不允许复制,请手动选择文本。",
    save: "保存", saving: "正在生成 {name}…", saved: "{name}:{size} KiB", all_files: "全部文件",
    file_specimen: "PPDEM 文件,含圆心角(与其手册示例一致)",
    file_full: "PPDEM 文件,另含各边浑圆度(与其手册字段表一致)",
    file_bodies: "供求解器使用的颗粒",
    file_grading: "级配:目标、实际、各粒径颗粒数",
    file_curve: "级配曲线", file_packing: "颗粒分布图", file_histogram: "粒径直方图",
    file_plain: "PPDEM 文件,圆形行首不写 1(与其手册字段表一致)",
    file_deposit: "脚本:重力沉积", file_biaxial: "脚本:双轴试验",
    file_summary: "目标与结果(JSON)", file_table: "表格另存为级配文件",
  },
};

/** More words, of another page: { en: {...}, zh: {...} }. */
export function add(more) {
  for (const code of Object.keys(WORDS)) Object.assign(WORDS[code], more[code]);
}

const KEPT = "hpcdem.language";
let language = "en";

/** The language in use, "en" or "zh". */
export const current = () => language;

/** Begin in the language chosen before, or in that of the browser. */
export function begin() {
  language = kept(KEPT) ?? (navigator.language?.startsWith("zh") ? "zh" : "en");
  if (!WORDS[language]) language = "en";
}

/** Take a language, and remember it. */
export function choose(code) {
  language = code;
  keep(KEPT, code);
}

/** The words of a name, with {x} replaced. */
export function say(name, values = {}) {
  const text = WORDS[language][name] ?? name;
  return text.replace(/\{(\w+)\}/g, (whole, key) => values[key] ?? whole);
}

/** Write the words into every element that refers to them. */
export function translate(root = document) {
  document.documentElement.lang = language === "zh" ? "zh-Hans" : "en";
  document.title = say("title");
  for (const e of root.querySelectorAll("[data-t]")) e.textContent = say(e.dataset.t);
  for (const e of root.querySelectorAll("[data-t-label]")) e.setAttribute("aria-label", say(e.dataset.tLabel));
  for (const e of root.querySelectorAll("[data-t-title]")) e.title = say(e.dataset.tTitle);
  for (const e of root.querySelectorAll("[data-t-hint]")) e.placeholder = say(e.dataset.tHint);
}

/** What was remembered under a name; storage may be forbidden. */
export function kept(name) {
  try { return localStorage.getItem(name); } catch { return null; }
}

/** Remember a text under a name, if that is allowed. */
export function keep(name, text) {
  try { localStorage.setItem(name, text); } catch { /* then it is forgotten */ }
}
