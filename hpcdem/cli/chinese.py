"""`--help` in Chinese: texts of options and programs by their English. What is not in the table stays English."""

from __future__ import annotations

import inspect
import re

import click

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
    "Also: `hpcdem measure DIR` measures a finished run, `hpcdem movie DIR` makes a film, `hpcdem grade FILE` makes grains "
    "from a grading curve, `hpcdem case` writes scripts of ready-made models, `hpcdem warmup` compiles all kernels for later "
    "runs, `hpcdem console` takes PCDC commands and Python line by line, `hpcdem doctor` says what is wrong with this machine "
    "or job. Exit codes: 0 done, 1 the run failed, 2 command line or script not understood, 3 no equilibrium (model solve), "
    "85 stopped on request with a checkpoint (go on with --resume).":
    "另有:`hpcdem measure DIR` 测量结果,`hpcdem movie DIR` 制作动画,`hpcdem grade FILE` 由级配曲线生成颗粒,`hpcdem case` "
    "写出现成模型的脚本,`hpcdem warmup` 预先编译计算核,`hpcdem console` 逐条输入 PCDC 命令和 Python,`hpcdem doctor` "
    "检查本机或作业的环境。退出码:0 完成,1 运行失败,2 命令行或脚本有误,3 没有达到平衡(model solve),85 "
    "按要求存盘后停止(用 --resume 继续)。",
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
}  # fmt: skip
"""English text of a help: the same in Chinese."""

LONG = {
    "view": "在浏览器页面中显示颗粒或块体的帧:移动、选择、着色、查询、播放、保存。\n\n进行中的运行会自动跟随。页面只对本机开放;"
    "在集群上用 ssh 转发:`ssh -L PORT:127.0.0.1:PORT host`,并在此用 --port PORT。",
    "sweep": "对参数值的每种组合运行一次 SCRIPT,每个成员有自己的目录,许多同时运行;或继续 DIR 中的扫描。",
    "doctor": "检查会使运行失败、变慢或有风险的因素:软件包、MPI 及其启动器、核和内存、文件系统、计算核缓存、Slurm、shell 限制,"
    "并给出该输入的命令。\n\n也可在 mpiexec 或 srun 下运行,检查全部进程和主机。退出码:0 没有问题,1 有问题。",
    "movie": "把 DIR 中的全部帧(颗粒或块体)做成动画,视野固定。\n\n生成 GIF;有 ffmpeg 时还生成 MP4。--showlable=true 在每帧写步数。",
}
"""Of commands whose English text is long, by their names."""

HEADS = {
    "Usage:": "用法:", "Options:": "选项:", "Stress and strain of a finished run:": "已完成运行的应力应变:",
    "[required]": "[必需]",
}  # fmt: skip

PARTLY = "(部分说明目前只有英文。)"


def translated(command: click.Command) -> click.Command:
    """The command with Chinese texts, as far as there are some; changed in place."""
    english = 0
    for parameter in command.params:
        if isinstance(parameter, click.Option) and parameter.help and not parameter.hidden:
            english += parameter.help not in TEXTS
            parameter.help = TEXTS.get(parameter.help, parameter.help)
    name = command.name or ""
    text = inspect.cleandoc(command.help or "")
    english += name not in LONG and text not in TEXTS
    command.help = LONG.get(name) or TEXTS.get(text, command.help)
    if command.epilog:
        english += command.epilog not in TEXTS
        command.epilog = TEXTS.get(command.epilog, command.epilog)
    if english:
        command.epilog = f"{command.epilog or ''}\n\n{PARTLY}".strip()
    return command


def help_page(command: click.Command, program: str) -> str:
    """What `--help` prints."""
    page = translated(command).get_help(click.Context(command, info_name=program, max_content_width=110))
    page = page.replace("Show this message and exit.", TEXTS["Show this message and exit."])
    for head, chinese in HEADS.items():
        page = re.sub(
            rf"^{re.escape(head)}" if head.endswith(":") else re.escape(head), chinese, page, flags=re.MULTILINE
        )
    return page
