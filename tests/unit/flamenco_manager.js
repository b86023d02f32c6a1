// What Flamenco's manager gives a job type, strictly: what its `author.go` and `scripts.go` do not have is an error.
"use strict";

const fs = require("fs");
const vm = require("vm");

const created = [];
const known = {
    "blender-render": { exe: "string", exeArgs: "string", argsBefore: "list", blendfile: "string", args: "list" },
    exec: { exe: "string", args: "list" },
};

function check(condition, message) {
    if (!condition) throw new Error(message);
}

function isListOfStrings(value) {
    return Array.isArray(value) && value.every((item) => typeof item === "string");
}

const author = Object.freeze({
    Task(name, type) {
        check(name.trim() && type.trim(), "a task needs a name and a type");
        const task = {
            name, type, priority: 50, commands: [], dependencies: [],
            addCommand(command) { check(command.name in known, "no command"); task.commands.push(command); },
            addDependency(other) { check(created.includes(other), "no task"); task.dependencies.push(other.name); },
        };
        created.push(task);
        return Object.seal(task);
    },
    Command(name, parameters) {
        check(name in known, `no command ${name}`);
        for (const [key, value] of Object.entries(parameters)) {
            check(key in known[name], `${name} has no parameter ${key}`);
            check(known[name][key] === "list" ? isListOfStrings(value) : typeof value === "string", `${name}: ${key}`);
        }
        check(Object.keys(known[name]).every((key) => key in parameters), `${name} lacks a parameter`);
        return Object.freeze({ name, parameters });
    },
});

function shellSplit(text) {
    return (text.match(/"[^"]*"|'[^']*'|\S+/g) || []).map((word) => word.replace(/^(["'])(.*)\1$/, "$2"));
}

const [script, request] = process.argv.slice(2);
const added = [];
const job = Object.seal({
    jobID: "1", name: "test", created: new Date(0), priority: 50, settings: JSON.parse(request),
    addTask(task) { check(created.includes(task), "no task"); added.push(task); },
});
const world = vm.createContext({
    author, shellSplit, print() {}, alert() {}, formatTimestampLocal: (time) => `T${time.getTime()}`,
    path: require("path").posix, String,
});
vm.runInContext(`"use strict";\n${fs.readFileSync(script, "utf8")}\nthis.JOB_TYPE = JOB_TYPE; this.compileJob = compileJob;`, world);
world.compileJob(job);
process.stdout.write(JSON.stringify({ type: world.JOB_TYPE, settings: job.settings, tasks: added }));
