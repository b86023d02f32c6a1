// Not run in Flamenco yet: checked against Flamenco 3's documentation and built-in job types, and by a test in Node.js.
// SPDX-License-Identifier: GPL-3.0-or-later

// A Flamenco 3 job type: bake a file's lightmaps on one machine, with workers on others at the same time.
// Put it into the folder `scripts` next to flamenco-manager; see docs/several-machines.md.

const JOB_TYPE = {
    label: "Radiosity Lightmaps",
    description: "Bake lightmaps on one machine, with the help of others",
    settings: [
        { key: "output", label: "Output Folder", type: "string", subtype: "dir_path", required: true,
          visible: "submission",
          description: "Folder in shared storage that the lightmaps, the baked file and the report go to" },
        { key: "helpers", label: "Helping Machines", type: "int32", default: 4, propargs: {min: 1, max: 1000},
          visible: "submission",
          description: "Machines that help the one that bakes, each in a task of its own" },
        { key: "processes", label: "Workers per Machine", type: "int32", default: 0, propargs: {min: 0, max: 1000},
          visible: "submission",
          description: "Worker processes on each helping machine. 0: one on each core" },
        { key: "options", label: "More Options", type: "string", default: "--quality medium", visible: "submission",
          description: "Options of the command line's bake, such as: --resolution 2048 --quality high" },

        // Known without asking.
        { key: "blendfile", type: "string", required: true, visible: "web",
          description: "Path of the Blend file to bake" },
        { key: "spool", type: "string", visible: "web", editable: false,
          description: "Folder through which the machines share the bake" },
    ]
};

// Seconds that helpers wait for the bake to begin.
const WAIT = "3600";

// The bake's task comes first: with one machine, helpers would else wait for it in vain. Flamenco's own are 50.
const FIRST = 60;

function compileJob(job) {
    const settings = job.settings;
    const output = settings.output.replace(/[\/\\]+$/, "");
    // A new one for each job, next to the output, whose folder is the bake's own.
    settings.spool = `${output}-spool-${formatTimestampLocal(job.created)}`;
    job.addTask(bakeTask(settings, output));
    for (let number = 1; number <= settings.helpers; number++) {
        job.addTask(helperTask(settings, number));
    }
}

function bakeTask(settings, output) {
    const task = author.Task("bake", "blender");
    task.priority = FIRST;
    task.addCommand(author.Command("blender-render", {
        exe: "{blender}",
        exeArgs: "{blenderArgs}",
        argsBefore: ["--background"],
        blendfile: settings.blendfile,
        args: [
            "--command", "radiosity", "bake",
            "--output", output,
            "--spool", settings.spool,
        ].concat(shellSplit(settings.options || "")),
    }));
    return task;
}

// No task depends on another: helpers are to run while the bake does, and end with it.
function helperTask(settings, number) {
    const task = author.Task(`help-${number}`, "blender");
    task.addCommand(author.Command("exec", {
        exe: "{blender}",
        args: [
            "--background", "--command", "radiosity", "worker", settings.spool,
            "--wait", WAIT,
            "--processes", String(settings.processes),
        ],
    }));
    return task;
}
