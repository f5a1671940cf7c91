"""`--help` in Chinese: texts of options and programs by their English. What is not in the table stays English."""

from __future__ import annotations

import inspect
import re

import click

from hpcdem.cli import case_chinese

TEXTS = {
    # hpcdem SCRIPT
    "Run a SCRIPT (ZDEM commands, PCDC commands, or Python that uses hpcdem), alone or under mpiexec or srun.\n\n"
    "ARGUMENTS are for Python, in sys.argv.":
    "运行 SCRIPT(ZDEM 命令、PCDC 命令,或使用 hpcdem 的 Python 程序),单独运行或在 mpiexec、srun 下运行。\n\n"
    "ARGUMENTS 供 Python 程序使用,在 sys.argv 中。",
    "Threads per rank [what srun -c gives, else 1; of a ZDEM script that one process runs alone OMP_NUM_THREADS, else all "
    "cores].": "每个进程的线程数 [srun -c 所给,否则 1;单个进程运行 ZDEM 脚本时为 OMP_NUM_THREADS,否则全部核]。",
    "Save and stop before this much time is up.": "在这段时间用完之前存盘并停止。",
    "Go on from the newest checkpoint of this script.": "从此脚本最新的重启文件继续。",
    "Keep the last K checkpoints [all].": "只保留最近 K 个重启文件 [全部]。",
    "Of older checkpoints keep the last at or before each multiple of N steps.":
    "更早的重启文件中,另保留每 N 步整数倍处或之前最后的一个。",
    "Of older checkpoints keep the last at or before each multiple of T seconds of the model.":
    "更早的重启文件中,另保留模型时间每 T 秒整数倍处或之前最后的一个。",
    "Of older checkpoints keep the last at or before these times of the model, in s.":
    "更早的重启文件中,另保留这些模型时间(秒)处或之前最后的一个。",
    "With --resume: from the last checkpoint at or before T seconds of the model.":
    "与 --resume 合用:从模型时间 T 秒处或之前最后的重启文件继续。",
    "From the last checkpoint at or before T seconds of the model.": "从模型时间 T 秒处或之前最后的重启文件继续。",
    "A checkpoint so long after the last one, or off [30:00].": "距上次存盘这么久后自动存盘,或 off [30:00]。",
    "Read the whole script, say what it would do, run nothing.": "读完整个脚本并说明会做什么,不运行。",
    "Results [data beside the script].": "结果目录 [脚本旁的 data]。",
    "Draw the last state at the end [yes].": "结束时画出最后状态 [是]。",
    "Move strip borders with the measured load [yes].": "按实测负载移动各进程的边界 [是]。",
    "Let DRAW commands make pictures, draw_<step>.jpg.": "让 DRAW 命令出图 draw_<step>.jpg。",
    "Log a fingerprint of the state every N steps.": "每 N 步在日志中写状态指纹。",
    "Compare the fingerprints with those of an earlier log.": "与以前日志中的指纹比较。",
    "Show the version and exit.": "显示版本后退出。",
    "Show this message and exit.": "显示本说明后退出。",
    "Each command has its own help: hpcdem NAME --help. Exit codes: 0 done, 1 the run failed, 2 command line or script not "
    "understood, 3 no equilibrium (model solve), 85 stopped on request with a checkpoint (go on with --resume).":
    "每个命令有自己的说明:hpcdem NAME --help。退出码:0 完成,1 运行失败,2 命令行或脚本有误,3 没有达到平衡(model solve),85 "
    "按要求存盘后停止(用 --resume 继续)。",
    # hpcdem NAME
    "Run": "运行", "Look": "查看", "Measure": "测量", "Make": "制作", "Manage": "管理",
    "continue an interrupted run from its newest checkpoint": "从最新的重启文件继续中断的运行",
    "take PCDC commands and Python line by line": "逐条输入 PCDC 命令和 Python",
    "run one script for many values and report on them": "用多组参数运行同一脚本并汇总",
    "open a run or a script in the browser": "在浏览器中打开运行结果或脚本",
    "draw frames as the window shows them": "按窗口中的样子画出各帧",
    "make a film of a run": "制作动画",
    "say what a frame or a checkpoint holds": "说明一帧或重启文件的内容",
    "measure a finished run: wedge, cracks, fluid, faults, ...": "测量已完成的运行:楔体、裂缝、流体、断层等",
    "stress and strain of the frames of a finished run": "计算已完成运行各帧的应力和应变",
    "write the script of a ready-made model": "写出现成模型的脚本",
    "list the examples, or copy one to this folder": "列出示例,或复制一个到当前目录",
    "make grains from a grading curve": "由级配曲线生成颗粒",
    "report problems of this machine or job and the commands that fix them": "检查本机或作业的问题并给出解决命令",
    "compile the kernels now, so that no job waits for it": "现在编译计算核,以后的作业不必等待",
    # hpcdem examples
    "List the examples; with NAME, copy one of them, with the files it reads.": "列出示例;给出 NAME 时复制该示例及其读取的文件。",
    "Then: hpcdem NAME.py. Each example says in its first lines what it shows.": "然后:hpcdem NAME.py。每个示例的开头几行说明其内容。",
    "Folder to copy the example to [this one].": "复制到的目录 [当前目录]。",
    # hpcdem -s
    "Stress and strain of the frames of a finished run, on a grid and on the particles.\n\nStrain is that since the first "
    "frame of DIR. Results of an earlier call are replaced when the new ones are complete.":
    "计算已完成运行各帧的应力和应变(网格和颗粒)。\n\n应变从 DIR 的第一帧算起;新结果完整后替换旧结果。",
    "Draw the results with `zdemss --dir DIR`. Also under mpiexec or srun.":
    "用 `zdemss --dir DIR` 出图;也可在 mpiexec、srun 下运行。",
    "Stress and strain of the frames in DIR, into DIR/ss/data.": "计算 DIR 中各帧的应力应变,写入 DIR/ss/data。",
    "Length in m over which stress is averaged, and spacing of the grid of --smooth [200].":
    "应力平均的长度(m),也是 --smooth 网格的间距 [200]。",
    "Particles were added between frames (sedimentation).": "帧之间添加过颗粒(沉积)。",
    "Particles were deleted between frames (erosion).": "帧之间删除过颗粒(剥蚀)。",
    "Leave out the particles to the left of this wall.": "不计此墙左侧的颗粒。",
    "Leave out the particles to the right of this wall.": "不计此墙右侧的颗粒。",
    "Add X [m] to all x [0].": "所有 x 加 X(m)[0]。",
    "Add Y [m] to all y [0].": "所有 y 加 Y(m)[0]。",
    "Strain since the frame before, not since the first one.": "应变从前一帧算起,而不是第一帧。",
    "Strain fitted and averaged on the grid, not by the nearest neighbours of particles.":
    "应变在网格上拟合、平均,而不用颗粒的最近邻。",
    "Threads per rank [what srun -c gives, else 1].": "每个进程的线程数 [srun -c 所给,否则 1]。",
    # hpcdem case
    "hpcdem case NAME --help lists its parameters. From Python: docs/cases.md.":
    "hpcdem case NAME --help 列出其参数。在 Python 中使用见 docs/cases.md。",
    # hpcdem resume
    "Go on with the run that wrote into DIR [data, or this folder], from its newest checkpoint that is whole.":
    "继续写入 DIR [data,或当前目录] 的运行,从最新的完整重启文件开始。",
    "Any number of ranks and threads: mpiexec -n 4 hpcdem resume DIR. The script is that of the run, wherever it is called "
    "from; if its file is gone, the text in the newest checkpoint is taken. Exit codes as for hpcdem SCRIPT; 0 also if the "
    "run is done.":
    "进程和线程数任意:mpiexec -n 4 hpcdem resume DIR。脚本是该运行的脚本;文件不在时取重启文件中的文本。退出码同 hpcdem SCRIPT;"
    "运行已完成时也为 0。",
    "Threads per rank [as for hpcdem SCRIPT].": "每个进程的线程数 [同 hpcdem SCRIPT]。",
    # hpcdem info
    "What is in a checkpoint (.sav), a frame (.vtkhdf, .dat) or the output folder of a run.":
    "说明重启文件(.sav)、帧(.vtkhdf、.dat)或输出目录的内容。",
    "Every byte of a checkpoint is compared with its checksum. Exit code 1 if a file is damaged or unknown.":
    "重启文件的每个字节都与校验和比较;文件损坏或不认识时退出码为 1。",
    "One JSON object per line and path.": "每个路径一行 JSON。",
    "Of a folder: look into all its files, not only the last ones.": "目录:查看全部文件,而不只是最后的。",
    # hpcdem view
    "Begin with this view *.mv [everything].": "从此视图文件 *.mv 开始 [全部]。",
    "[a free one].": "端口 [任一空闲端口]。",
    "Only print the address.": "只打印地址,不打开浏览器。",
    # hpcdem sweep
    "Values of a parameter of the script; may be given again: all are crossed.": "脚本中一个参数的各个值;可重复,全部交叉。",
    "The same as --set seed=VALUES; in ZDEM of SET seed.": "同 --set seed=VALUES;ZDEM 中为 SET seed。",
    "N samples of the ranges: a Latin hypercube.": "在范围内取 N 个样本:拉丁超立方。",
    "N samples of the ranges: a Sobol sequence.": "在范围内取 N 个样本:Sobol 序列。",
    "Seed of the sampling itself [0].": "抽样本身的种子 [0]。",
    "Ranks of each member [1].": "每个成员的进程数 [1]。",
    "Threads of each rank [1].": "每个进程的线程数 [1]。",
    "Members at once [auto: as many as there are cores for].": "同时运行的成员数 [auto:核数允许的最多个]。",
    "So often a member is started that fails or is killed; it goes on from its last checkpoint [2].":
    "成员失败或被终止后最多启动几次,从其最后的重启文件继续 [2]。",
    "A file or folder that the script reads from beside it; may be given again.": "脚本从旁边读取的文件或目录;可重复。",
    "Folder of the sweep [SCRIPT_sweep beside the script].": "扫描的目录 [脚本旁的 SCRIPT_sweep]。",
    "Write the members and list them, run nothing.": "写出并列出成员,不运行。",
    "Submit a job array to Slurm, a task for each member that is not done.": "向 Slurm 提交作业数组,每个未完成的成员一个任务。",
    "Option of sbatch, as time=04:00:00; may be given again.": "sbatch 的选项,如 time=04:00:00;可重复。",
    # hpcdem console, warmup, doctor
    "Take PCDC commands and Python line by line, on one rank. Tab completes; exit() or Ctrl-D ends.":
    "逐条输入 PCDC 命令和 Python(单进程)。Tab 补全;exit() 或 Ctrl-D 结束。",
    "Threads [what srun -c gives, else 1].": "线程数 [srun -c 所给,否则 1]。",
    "Results [data in this folder].": "结果目录 [当前目录的 data]。",
    "Compile all kernels now, for example on a login node, so that no job waits for it.":
    "现在编译全部计算核(例如在登录节点),以后的作业不必等待。",
    "Threads of the later runs [1].": "以后运行的线程数 [1]。",
    "Kernels [all].": "哪些计算核 [全部]。",
    "Where results will go [.].": "结果将写到哪里 [.]。",
    # hpcdem movie, in part
    "Frames per second [10].": "每秒帧数 [10]。",
    "Width in pixels [1200].": "宽度(像素)[1200]。",
    "The film [DIR/movie.gif, .mp4].": "动画文件 [DIR/movie.gif、.mp4]。",
    # draw, grade, measure, movie, sweep report, view, zdem2jpg, zdemss
    "ZDEM commands in place of PCDC commands and Python.": "输入 ZDEM 命令,而不是 PCDC 命令和 Python。",
    "What is shown, as a view *.mv says; the options below change it [everything].":
    "显示什么,由视图文件 *.mv 给出;以下选项可修改它 [全部]。",
    "Colour objects by this field; --list tells which there are.": "按此场给对象着色;--list 列出有哪些场。",
    "Of which objects --field and the options below are: elements, particles, joints, ... [the first that have the "
    "field].":
    "--field 和以下选项针对的对象:elements、particles、joints 等 [有此场的第一种]。",
    "Values of the first and the last colour; full: the least and the greatest [those that 1 % is below or above].":
    "首末颜色对应的值;full:最小值和最大值 [各有 1 % 的值在其外]。",
    "Colours by the logarithm.": "颜色按对数分布。",
    "viridis, cividis, yellow-brown, blue-red, ... (docs/view.md) [viridis].":
    "viridis、cividis、yellow-brown、blue-red 等(docs/view.md)[viridis]。",
    "One colour for all.": "全部用一种颜色。",
    "From 0 to 1 [1].": "从 0 到 1 [1]。",
    "Outlines of elements and particles [of small meshes].": "单元和颗粒的轮廓线 [小网格的]。",
    "Factor on radii of particles and widths of lines [1].": "颗粒半径和线宽的倍数 [1]。",
    "Arrows of this field: displacement, velocity, force.": "此场的箭头:displacement、velocity、force。",
    "Factor on the length of arrows [1].": "箭头长度的倍数 [1]。",
    "Only objects for which this holds: 'stress_yy < -1e6 and x > 2'.":
    "只显示满足条件的对象:'stress_yy < -1e6 and x > 2'。",
    "Leave these objects out; may stand several times.": "不显示这些对象;可多次给出。",
    "Show these objects (contacts and bonds are hidden).": "显示这些对象(接触和胶结平时隐藏)。",
    "Factor on displacements of blocks [1].": "块体位移的放大倍数 [1]。",
    "Left, right, bottom, top of the picture, m; in space along the picture and up it [all].":
    "图的左、右、下、上,m;三维时沿图面水平和竖直方向 [全部]。",
    "In space: seen from +x, -x, +y, -y, +z, -z, iso (right, front, above), or from this direction [iso].":
    "三维:从 +x、-x、+y、-y、+z、-z、iso(右、前、上)看,或从给定方向看 [iso]。",
    "In space: cut by x=1.5 (the part towards the eye is taken away), x<1.5, x>1.5 (what stays), or "
    "PX,PY,PZ,NX,NY,NZ (a point, the normal into what goes).":
    "三维:用 x=1.5 切开(去掉朝向观察者的部分),x<1.5、x>1.5(保留的部分),或 PX,PY,PZ,NX,NY,NZ(一点和指向去掉部分的法"
    "向)。",
    "Over the picture; {step} and {time} are filled in.": "图上方的标题;{step} 和 {time} 会被填入。",
    "Without axes.": "不画坐标轴。",
    "Without legend and bars of colours.": "不画图例和色标。",
    "Of a folder: only the frame of this step.": "目录中只取这一步的帧。",
    "Of a folder: frames of blocks NAME_<step>.vtkhdf.": "目录中取块体帧 NAME_<step>.vtkhdf。",
    "The picture, or a film *.gif or *.mp4 [beside each frame].": "输出的图,或动画 *.gif、*.mp4 [在每帧旁边]。",
    "Some of png, jpg, tiff, pdf, svg [png].": "png、jpg、tiff、pdf、svg 中的若干种 [png]。",
    "Dots per inch [300].": "每英寸点数 [300]。",
    "Width of the picture, cm [17].": "图宽,cm [17]。",
    "Size of letters, points [9].": "字号,磅 [9]。",
    "Frames per second of a film [10].": "动画每秒帧数 [10]。",
    "Processes that draw at a time [one per core].": "同时绘图的进程数 [每核一个]。",
    "Write what is shown as a view *.mv.": "把所示内容写成视图文件 *.mv。",
    "Draw nothing: say which objects and fields there are.": "不绘图,只列出有哪些对象和场。",
    "Draw frames of particles or of blocks: PNG, JPG, TIFF, and true vectors in PDF and SVG.\n\nOf a folder all "
    "frames are drawn, at one place and with one range of colours. Under mpiexec or srun the ranks share\nthem.":
    "绘制颗粒或块体的帧:PNG、JPG、TIFF,以及真正矢量的 PDF 和 SVG。\n\n给出目录时绘制所有帧,位置和颜色范围相同;在 "
    "mpiexec 或 srun 下各进程分担。",
    "Shape of the grains [circle].": "颗粒的形状 [circle]。",
    "Number of grains [200, unless --width].": "颗粒数 [200,除非给出 --width]。",
    "Width of the box in mm; the number of grains follows.": "试样箱的宽度,mm;颗粒数由此得出。",
    "Height over width of the box [2].": "试样箱的高宽比 [2]。",
    "Voids over grains, by area [0.5].": "孔隙比,按面积 [0.5]。",
    "ellipse: long over short axis [1.5].": "ellipse:长轴与短轴之比 [1.5]。",
    "ellipse: what its size is: an axis, or the diameter of a circle of its area [major].":
    "ellipse:粒径指哪一个量:某一轴,或等面积圆的直径 [major]。",
    "Polygons: how far vertices may be off, in degrees [0].": "多边形:顶点允许的偏差,度 [0]。",
    "Polygons: 0 straight edges, 1 a circle [0].": "多边形:0 为直边,1 为圆 [0]。",
    "Mass of a grain goes with its size squared, or cubed for the numbers of a sieve curve of real grains [2].":
    "颗粒质量与粒径的平方成正比;用真实颗粒筛分曲线的数目时为立方 [2]。",
    "dense: in the box at the void ratio; cells: loose, one grain per cell of a column [dense].":
    "dense:按孔隙比置于箱中;cells:松散,柱状排列,每格一粒 [dense]。",
    "cells: cell over largest grain [2].": "cells:格子与最大颗粒之比 [2]。",
    "Seed of the random numbers [0].": "随机数种子 [0]。",
    "Folder for the files [specimen].": "输出文件的目录 [specimen]。",
    "PPDEM file: arcs; with a column of roundness; circles without the leading 1 [sample; with --read the one that "
    "fits].":
    "PPDEM 文件:圆弧;带圆度一列;圆,不带行首的 1 [sample;与 --read 合用时取相符的一种]。",
    "PPDEM file: numbers per degree of central angle [1].": "PPDEM 文件:圆心角每度对应的数 [1]。",
    "Largest gap between outlines and the discs of clumps, over the size [0.03].":
    "轮廓与组成团块的圆盘之间的最大间隙,相对粒径 [0.03]。",
    "Figures: png, jpg, pdf, svg, with commas between them, or none [png].":
    "图的格式:png、jpg、pdf、svg,用逗号隔开,或 none [png]。",
    "Grading curve with sizes that fall to the right.": "级配曲线的粒径向右减小。",
    "Print the summary as JSON.": "以 JSON 打印汇总。",
    "Look into a PPDEM file instead; FILE, if given, is the grading to compare it with.":
    "改为查看一个 PPDEM 文件;如给出 FILE,则与此级配比较。",
    "Make a specimen that has the grading curve in FILE: grains of one shape, in their places.\n\n\b\nspecimen.dat "
    "           the outlines, for PPDEM\nspecimen.xyr, .clumps   circles for LOAD, other shapes as clumps of discs "
    "for CLUMP\ndeposit.py, biaxial.py  scripts that go on with them\ngrading.csv, specimen.json, figures of "
    "grading, packing and sizes":
    "生成级配曲线与 FILE 相符的试样:同一形状的颗粒及其位置。\n\n\b\nspecimen.dat            轮廓,供 PPDEM 使用\n"
    "specimen.xyr, .clumps   圆供 LOAD,其他形状为圆盘团块供 CLUMP\ndeposit.py, biaxial.py  用它们继续计算的脚本\n"
    "grading.csv, specimen.json,以及级配、排列和粒径的图",
    "FILE holds a size in mm and the per cent of mass finer than it per line. What the words mean: "
    "docs/specimens.md.":
    "FILE 每行为粒径(mm)和小于它的质量百分数。术语见 docs/specimens.md。",
    "Show it on a page in the browser, where sliders change it, and which saves the files; FILE is where the table "
    "begins. To this machine only.":
    "在浏览器页面中显示,用滑块修改并存盘;FILE 为表格的初值。只对本机开放。",
    "--serve: port [a free one].": "--serve:端口 [任一空闲端口]。",
    "--serve: only print the address.": "--serve:只打印地址。",
    "Folder for the results [DIR/measure].": "结果目录 [DIR/measure]。",
    "Wall that pushes (wedge, shortening); walls of wallforce, may be given again [the one that goes farthest; all "
    "walls].":
    "推动的墙(wedge、缩短量);wallforce 的墙,可多次给出 [走得最远的一面;全部墙]。",
    "Only particles, or elements, of these groups.": "只取这些组的颗粒或单元。",
    "Only particles of these colours, by name or number.": "只取这些颜色的颗粒,颜色用名称或编号。",
    "First step [where the wall that pushes begins to move].": "起始步 [推动的墙开始移动处]。",
    "Last step [the last].": "终止步 [最后一步]。",
    "Width of the columns of the surface, and of cells for strain, in m [about three radii].":
    "地表分列以及应变网格的宽度,m [约三倍半径]。",
    "faults: threshold of |strain| [0.5 in sections, 0.2 from frame to frame].":
    "faults:|应变| 的阈值 [剖面 0.5,逐帧 0.2]。",
    "faults: shortest band in m [6 cells].": "faults:最短的带,m [6 个网格]。",
    "faults: leave out what is nearer than H m to the base and to the wall that pushes [2 cells].":
    "faults:不计距底面和推动墙不足 H m 的部分 [2 个网格]。",
    "faults: strain from frame to frame even where there are sections.": "faults:即使有剖面,也用逐帧应变。",
    "tracks: particles of these ids.": "tracks:这些编号的颗粒。",
    "tracks: the particles nearest to this point (m) in the first frame; may be given again.":
    "tracks:第一帧中离此点(m)最近的颗粒;可多次给出。",
    "tracks: so many to each point [1].": "tracks:每个点取这么多颗粒 [1]。",
    "cracks: log of the run, which counts breaks in tension and in shear.":
    "cracks:运行的日志,其中统计了拉、剪破坏数。",
    "emission: history that is drawn with the events, or none [the first of a reaction, else of a stress].":
    "emission:与事件同图绘制的监测量,或 none [第一个反力,否则第一个应力]。",
    "emission: parts of the time in which events are counted [100].": "emission:统计事件的时间分段数 [100]。",
    "emission: magnitude from which the b-value is taken [that of most events].":
    "emission:计算 b 值的起始震级 [事件最多的震级]。",
    "emission: kinetic energy when a joint broke, or by how much it grew since the joint's peak [kinetic].":
    "emission:节理破坏时的动能,或自其峰值以来增加的动能 [kinetic]。",
    "emission: J per unit of energy in the files, thickness of the model included [1].":
    "emission:文件中能量单位对应的 J,已计入模型厚度 [1]。",
    "regions: elements with their middle in this box of the mesh, m: its least x, y, z, its greatest.":
    "regions:中点在此长方体内的网格单元,m:最小的 x、y、z,最大的 x、y、z。",
    "Measure the frames in DIR: tables (CSV) and figures of\n\n\b\nsurface    profiles of the surface\nwedge      "
    "crest, toe, height, width, slopes and taper\nfaults     bands of strain: place, length, dip, vergence\n"
    "wallforce  forces on walls over their way, and work\ntracks     paths of particles: --ids, --near, all of "
    "--groups or --colors, or some spread over the bed\nlayers     areas of colours and groups\ncracks     broken "
    "bonds or joints, by mode and time, and damage\nfragments  of blocks: number, areas, distribution of sizes\n"
    "emission   of blocks: joints that broke as acoustic events: rate, magnitudes, b-value\nfluid      of blocks: "
    "wet length or area, volume, largest pressure, aperture and velocity; each channel of the last\nregions    of "
    "blocks in space: volume, extent, mean stress and strain of groups and of a --box\ndisplacement  of blocks in "
    "space: how far their surface has moved":
    "测量 DIR 中的帧,得到表(CSV)和图:\n\n\b\nsurface    地表剖面\nwedge      楔体的顶、趾、高、宽、坡角和锥角\n"
    "faults     应变带:位置、长度、倾角、倾向\nwallforce  墙上的力随其行程的变化,以及功\ntracks     颗粒轨迹"
    ":--ids、--near、--groups 或 --colors 的全部,或地层中分布的若干个\nlayers     各颜色和组的面积\ncracks     断开"
    "的胶结或节理,按方式和时间,以及损伤\nfragments  块体:碎块的数目、面积、尺寸分布\nemission   块体:节理破坏作为声"
    "发射事件:速率、震级、b 值\nfluid      块体:湿润长度或面积、体积、最大压力、开度和流速;最后一帧的各通道\nregions    "
    "三维块体:各组及 --box 的体积、范围、平均应力和应变\ndisplacement  三维块体:表面的位移",
    "Without WHAT all that the folder allows. Also under mpiexec or srun: ranks share the frames.":
    "不给 WHAT 时测量目录所允许的全部。也可在 mpiexec 或 srun 下运行,各进程分担各帧。",
    "Frames of DIR, or the pictures *.jpg that zdemss made in DIR/ss [frames].":
    "DIR 的帧,或 zdemss 在 DIR/ss 中生成的图 *.jpg [frames]。",
    "[gif, and mp4 where ffmpeg is].": "[gif;有 ffmpeg 时还有 mp4]。",
    "Frames of blocks NAME_<step>.vtkhdf [the name most of them have].": "块体帧 NAME_<step>.vtkhdf [数目最多的名称]。",
    "Of blocks: cracks by the way they broke, compressive stress, plastic strain, temperature, of fluid in joints "
    "pressure, saturation, aperture or velocity, concentration of proppant; both: the first two [what there is].":
    "块体:按破坏方式的裂纹、压应力、塑性应变、温度,节理中流体的压力、饱和度、开度或流速,支撑剂浓度;both:前两种 [有"
    "什么画什么]。",
    "Left end of the picture, m [0].": "图的左端,m [0]。",
    "Right end, m [the model's].": "右端,m [模型的右端]。",
    "Lower end, m [0].": "下端,m [0]。",
    "Upper end, m [the model's].": "上端,m [模型的上端]。",
    "Move the model along x, m [0].": "模型沿 x 平移,m [0]。",
    "Move the model along y, m [0].": "模型沿 y 平移,m [0]。",
    "Step of ticks with numbers, m [10000, or what suits the model].": "带数字的刻度间距,m [10000,或适合模型的值]。",
    "Step of ticks without numbers, m [1000, or what suits the model].": "不带数字的刻度间距,m [1000,或适合模型的值]。",
    "Size of the numbers, points [9].": "数字的字号,磅 [9]。",
    "Width of lines, points [0.8].": "线宽,磅 [0.8]。",
    "Left line of the frame [true].": "边框左线 [true]。",
    "Right line of the frame [true].": "边框右线 [true]。",
    "Lower line of the frame [true].": "边框下线 [true]。",
    "Upper line of the frame [true].": "边框上线 [true]。",
    "Walls [true].": "墙 [true]。",
    "Line over the top of the model [true].": "模型顶面的线 [true]。",
    "Particles [true].": "颗粒 [true]。",
    "Contacts: black not bonded, red bonded in tension, blue bonded in compression [false].":
    "接触:黑色为无胶结,红色为受拉的胶结,蓝色为受压的胶结 [false]。",
    "Ten lines of red, green, blue; searched here, in DIR, at home.": "十行红、绿、蓝;在此处、DIR 和主目录中寻找。",
    "Step, or this text, in the corner [false].": "在角上写步数,或这段文字 [false]。",
    "Folder for the report [DIR/report].": "报告目录 [DIR/report]。",
    "csv, parquet (needs pyarrow), with commas between them [csv].": "csv、parquet(需要 pyarrow),用逗号隔开 [csv]。",
    "Measure all members of the sweep in DIR that are done, and put them beside each other: mean, spread and "
    "quantiles, bands over time, dependence on the parameters. Without WHAT all that the runs allow; histories "
    "always.":
    "测量 DIR 中扫描的所有已完成成员并排比较:平均、离散、分位数、随时间的带、对参数的依赖。不给 WHAT 时为运行所允许"
    "的全部;监测量总是包括在内。",
    "WHAT: surface, wedge, faults, wallforce, layers, cracks, fragments, emission, fluid, regions, displacement, "
    "as for hpcdem measure. Also under mpiexec: ranks share the frames.":
    "WHAT:surface、wedge、faults、wallforce、layers、cracks、fragments、emission、fluid、regions、displacement,同 "
    "hpcdem measure。也可在 mpiexec 下运行,各进程分担各帧。",
    "VALUES: 0.2,0.3 (these), 1:10 (whole numbers), 0.1:0.5:5 (five at equal distance); with --latin or --sobol "
    "0.1:0.5 and 1e5:1e8:log are ranges that are sampled. A parameter is a line such as friction = 0.3 at the top "
    "level of the script (in ZDEM used as {friction}). The same words again go on with what is not done. More in "
    "docs/sweep.md; `hpcdem sweep report --help`.":
    "VALUES:0.2,0.3(这些值)、1:10(整数)、0.1:0.5:5(等距五个);与 --latin 或 --sobol 合用时 0.1:0.5 和 1e5:1e8:log 是"
    "抽样范围。参数是脚本顶层的一行,如 friction = 0.3(ZDEM 中写作 {friction})。再次输入同样的命令即继续未完成的部分"
    "。详见 docs/sweep.zh.md;`hpcdem sweep report --help`。",
    "A console for commands and an editor for the scripts of a folder: whoever can open the page can run programs.":
    "命令控制台和目录中脚本的编辑器:凡能打开此页面者都能运行程序。",
    "Threads of the console [1].": "控制台的线程数 [1]。",
    "Folder of the frames.": "帧所在的目录。",
    "Dots per inch [600].": "每英寸点数 [600]。",
    "Width of the picture, cm [14].": "图宽,cm [14]。",
    "Some of jpg, png, tiff, pdf, svg with commas between them [jpg].":
    "jpg、png、tiff、pdf、svg 中的若干种,用逗号隔开 [jpg]。",
    "Particles in the colours of a field: vx, rotation, stress, ... (see `hpcdem draw --list`) [their own].":
    "颗粒按某个场着色:vx、rotation、stress 等(见 `hpcdem draw --list`)[各自的颜色]。",
    "--field: values of the first and the last colour; full: the least and the greatest [those that 1 % is below or "
    "above].":
    "--field:首末颜色对应的值;full:最小值和最大值 [各有 1 % 的值在其外]。",
    "--field: viridis, cividis, blue-red, ... [viridis].": "--field:viridis、cividis、blue-red 等 [viridis]。",
    "Draw every frame all_*.vtkhdf or all_*.dat in DIR as a picture of the same name beside it.\n\nUnder mpiexec "
    "or srun the ranks share the frames.":
    "把 DIR 中的每一帧 all_*.vtkhdf 或 all_*.dat 画成同名的图,放在旁边。\n\n在 mpiexec 或 srun 下各进程分担各帧。",
    "Particles were added between the frames [OFF].": "帧之间添加过颗粒 [OFF]。",
    "Particles were removed between the frames [OFF].": "帧之间删除过颗粒 [OFF]。",
    "Draw volumetric strain [ON].": "绘制体积应变 [ON]。",
    "Draw distortional strain as the manual's pages do, the second invariant J2; root: its square root [ON].":
    "绘制畸变应变,与手册图页相同,为第二不变量 J2;root:其平方根 [ON]。",
    "Draw mean stress [ON].": "绘制平均应力 [ON]。",
    "Draw shear stress as the manual's pages do, sigma1 - sigma3; half: (sigma1 - sigma3)/2 [ON].":
    "绘制剪应力,与手册图页相同,为 sigma1 - sigma3;half:(sigma1 - sigma3)/2 [ON]。",
    "Draw the largest principal stress as bars over the distortional strain [OFF].":
    "在畸变应变上用短线绘制最大主应力 [OFF]。",
    "Length of these bars: gridsize times this where the stress is largest [1].":
    "这些短线的长度:应力最大处为 gridsize 乘以此数 [1]。",
    "Side of the squares over which they are averaged (m) [600].": "求平均的正方形边长(m)[600]。",
    "Draw colour bars [ON].": "绘制色标 [ON]。",
    "Name the panels; abc: by letters only [ON].": "给各分图命名;abc:只用字母 [ON]。",
    "GMT colour table (CPT) for both strains, or invar, invar2 [default: invar2 for the distortional one].":
    "两种应变的 GMT 色表(CPT),或 invar、invar2 [默认:畸变应变用 invar2]。",
    "Stress at the end of the colour bar (MPa) [300].": "色标末端的应力(MPa)[300]。",
    "Where the x axis ends (km) [all is shown].": "x 轴终点(km)[全部]。",
    "Where the y axis ends (km) [all is shown].": "y 轴终点(km)[全部]。",
    "Width of the pictures (cm) [14].": "图宽(cm)[14]。",
    "Some of jpg, png, tiff, pdf, svg, ps with commas between them [jpg,ps].":
    "jpg、png、tiff、pdf、svg、ps 中的若干种,用逗号隔开 [jpg,ps]。",
    "Draw stress and strain of the frames in DIR, after `hpcdem -s DIR`.\n\nPages as DIR/ss/*.jpg and "
    "DIR/ss/ps/*.ps, numbers in DIR/ss/data2ps, grids in DIR/ss/Tmp.":
    "在 `hpcdem -s DIR` 之后绘制 DIR 中各帧的应力和应变。\n\n图页为 DIR/ss/*.jpg 和 DIR/ss/ps/*.ps,数据在 "
    "DIR/ss/data2ps,网格在 DIR/ss/Tmp。",
    "`hpcdem -s DIR` comes first: it computes what is drawn here.": "先运行 `hpcdem -s DIR`:此处所绘由它计算。",
}  # fmt: skip
"""English text of a help: the same in Chinese."""
DONE = frozenset(TEXTS.values())

LONG = {
    "view": "在浏览器页面中显示颗粒或块体的帧:移动、选择、着色、查询、播放、保存。\n\n进行中的运行会自动跟随。页面只对本机开放;"
    "在集群上用 ssh 转发:`ssh -L PORT:127.0.0.1:PORT host`,并在此用 --port PORT。",
    "sweep": "对参数值的每种组合运行一次 SCRIPT,每个成员有自己的目录,许多同时运行;或继续 DIR 中的扫描。",
    "doctor": "检查会使运行失败、变慢或有风险的因素:软件包、MPI 及其启动器、核和内存、文件系统、计算核缓存、Slurm、shell 限制,"
    "并给出该输入的命令。\n\n也可在 mpiexec 或 srun 下运行,检查全部进程和主机。退出码:0 没有问题,1 有问题。",
    "movie": "把 DIR 中的全部帧(颗粒或块体)做成动画,视野固定。\n\n生成 GIF;有 ffmpeg 时还生成 MP4。--showlable=true 在每帧写步数。",
}
"""Of commands whose English text is long, by their names."""

CASES = {
    "Write the script of a ready-made model.": "写出现成模型的脚本。",
    ": write its script.": ":写出其脚本。",
}
_PARAMETERS = {text[:1].upper() + text[1:]: meant for text, meant in case_chinese.PARAMETERS.items()} | {
    "The script; - prints it": "脚本文件;- 表示打印出来",
    "Replace the file if it is there": "文件已存在时替换",
}

HEADS = {
    "Usage:": "用法:", "Options:": "选项:", "Stress and strain of a finished run:": "已完成运行的应力应变:",
    "[required]": "[必需]",
}  # fmt: skip

FIRST = """\
hpcdem:岩石与砂土的离散元程序。用法:hpcdem SCRIPT,或 hpcdem COMMAND ...

  hpcdem examples             列出示例;hpcdem examples push.py 把一个示例复制到当前目录
  hpcdem --check SCRIPT       只读脚本,说明它会做什么,不运行
  hpcdem SCRIPT               运行;结果写入脚本旁的 data(Ctrl-C 存盘并停止,--resume 继续)
  hpcdem view data            在浏览器中看结果,运行中也可以
  hpcdem view --run SCRIPT    同上,并带编辑器与命令行
  hpcdem doctor               检查这台机器有什么问题,以及怎样解决

hpcdem --help 给出全部说明。"""
"""不带参数的 `hpcdem` 所显示的内容。"""
PARTLY = "(部分说明目前只有英文。)"


def in_chinese(text: str) -> str:
    """A text of the table, or the text itself."""
    return TEXTS.get(text, text)


def translated(command: click.Command) -> click.Command:
    """The command with Chinese texts, as far as there are some; changed in place."""
    english = 0
    for parameter in command.params:
        if isinstance(parameter, click.Option) and parameter.help and not parameter.hidden:
            meant = TEXTS.get(parameter.help) or _of_a_case(parameter.help)
            english += not meant and parameter.help not in DONE  # programs share some
            parameter.help = meant or parameter.help
    name = command.name or ""
    text = inspect.cleandoc(command.help or "")
    meant = LONG.get(name) or TEXTS.get(text)
    if not meant and (meant := _of_cases(text)):
        english += any(line.isascii() and line.strip("\b") for line in meant.splitlines())
    english += not meant
    command.help = meant or command.help
    if command.epilog:
        english += command.epilog not in TEXTS
        command.epilog = TEXTS.get(command.epilog, command.epilog)
    if english:
        command.epilog = f"{command.epilog or ''}\n\n{PARTLY}".strip()
    return command


def _of_a_case(text: str) -> str | None:
    """A parameter of a ready-made model, `What it is [default].`"""
    whole = re.fullmatch(r"(.+?)( \[[^\[]*\])?\.", text)
    if whole is None or whole[1] not in _PARAMETERS:
        return None
    default = {" [yes]": " [是]", " [no]": " [否]"}.get(whole[2] or "", whole[2] or "")
    return f"{_PARAMETERS[whole[1]]}{default.replace(' degrees]', ' 度]')}。"


def _of_cases(text: str) -> str | None:
    """What the programs of ready-made models say, with the titles of these; None of other programs."""
    meant = text
    for english, chinese in (case_chinese.TITLES | CASES).items():
        meant = re.sub(rf"{re.escape(english)}(?=$|: write)", chinese, meant, flags=re.MULTILINE)
    return None if meant == text else meant


def help_page(command: click.Command, program: str) -> str:
    """What `--help` prints."""
    page = translated(command).get_help(click.Context(command, info_name=program, max_content_width=110))
    page = page.replace("Show this message and exit.", TEXTS["Show this message and exit."])
    for head, chinese in HEADS.items():
        page = re.sub(
            rf"^{re.escape(head)}" if head.endswith(":") else re.escape(head), chinese, page, flags=re.MULTILINE
        )
    return page
