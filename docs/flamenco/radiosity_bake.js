// Not run in Flamenco yet: checked against Flamenco 3's documentation and built-in job types, and by a test in Node.js.
// SPDX-License-Identifier: GPL-3.0-or-later

// A Flamenco 3 job type: bake a file's lightmaps in stages, the middle one with workers on other machines.
// Put it into the folder `scripts` next to flamenco-manager; see docs/several-machines.md.

const JOB_TYPE = {
    label: "Radiosity Lightmaps",
    description: "Prepare a bake, run it with the help of other machines, and finish it",
    settings: [
        { key: "output", label: "Output Folder", type: "string", subtype: "dir_path", required: true,
          visible: "submission",
          description: "Folder in shared storage that the lightmaps, the baked file and the report go to" },
        { key: "helpers", label: "Helping Machines", type: "int32", default: 4, propargs: {min: 1, max: 1000},
          visible: "submission",
          description: "Machines that help the one that runs the bake, each in a task of its own" },
        { key: "processes", label: "Workers per Machine", type: "int32", default: 0, propargs: {min: 0, max: 1000},
          visible: "submission",
          description: "Worker processes on each helping machine. 0: one on each core" },
        { key: "options", label: "More Options", type: "string", default: "--quality medium", visible: "submission",
          description: "Options of the command line's prepare, such as: --resolution 2048 --quality high" },

        // Known without asking.
        { key: "blendfile", type: "string", required: true, visible: "web",
          description: "Path of the Blend file to bake" },
        { key: "spool", type: "string", visible: "web", editable: false,
          description: "Folder through which the machines share the bake" },
    ]
};

// Seconds that helpers wait for the bake to begin.
const WAIT = "3600";

// The bake's own tasks come first: with one machine, helpers would else wait for it in vain. Flamenco's own are 50.
const FIRST = 60;

function compileJob(job) {
    const settings = job.settings;
    const output = settings.output.replace(/[\/\\]+$/, "");
    // A new one for each job, next to the output, whose folder is the bake's own.
    settings.spool = `${output}-spool-${formatTimestampLocal(job.created)}`;
    const prepare = withScene("prepare", settings, shellSplit(settings.options || ""));
    const run = withSpool("run", ["run", settings.spool], FIRST);
    run.addDependency(prepare);
    const finish = withScene("finish", settings, ["--output", output]);
    finish.addDependency(run);
    job.addTask(prepare);
    job.addTask(run);
    // Helpers are to work while the bake runs, and end with it.
    for (let number = 1; number <= settings.helpers; number++) {
        const words = ["worker", settings.spool, "--wait", WAIT, "--processes", String(settings.processes)];
        const help = withSpool(`help-${number}`, words);
        help.addDependency(prepare);
        job.addTask(help);
    }
    job.addTask(finish);
}

// A stage that needs the scene.
function withScene(verb, settings, options) {
    const task = author.Task(verb, "blender");
    task.priority = FIRST;
    task.addCommand(author.Command("blender-render", {
        exe: "{blender}",
        exeArgs: "{blenderArgs}",
        argsBefore: ["--background"],
        blendfile: settings.blendfile,
        args: ["--command", "radiosity", verb, "--spool", settings.spool].concat(options),
    }));
    return task;
}

// What needs the spool alone; bytes depend on Python's and NumPy's versions, so it is done by the same Blender.
function withSpool(name, words, priority) {
    const task = author.Task(name, "blender");
    if (priority) task.priority = priority;
    task.addCommand(author.Command("exec", {
        exe: "{blender}",
        args: ["--background", "--command", "radiosity"].concat(words),
    }));
    return task;
}
