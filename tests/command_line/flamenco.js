// SPDX-License-Identifier: GPL-3.0-or-later
// What a manager of Flamenco 3 does with submitted jobs, as far as our job type can tell: jobs (JSON) in, for each its
// tasks (JSON) out, or the status and sentence of a refusal. test_flamenco.py compares it with a real manager.
const fs = require("fs");
const path = require("path");
const vm = require("vm");

const script = process.argv[2];
const source = fs.readFileSync(script, "utf8");
const jobs = JSON.parse(fs.readFileSync(0, "utf8"));

const author = {
    Task: (name, type) => ({
        name, type, commands: [], waits: [],
        addCommand(command) { this.commands.push(command); },
        addDependency(task) { this.waits.push(task.name); },
    }),
    Command: (name, parameters) => ({ name, parameters }),
};

// "2006-01-02_150405" in the language of the manager, in local time.
function formatTimestampLocal(date) {
    const [year, month, day, ...time] = [
        date.getFullYear(), date.getMonth() + 1, date.getDate(), date.getHours(), date.getMinutes(), date.getSeconds(),
    ].map((part) => String(part).padStart(2, "0"));
    return `${year}-${month}-${day}_${time.join("")}`;
}

// A task is added as it is by then. The manager fills in no defaults of settings: only Blender's add-on does.
function submitted({ settings, created, jobID }) {
    const tasks = [];
    const addTask = (task) => tasks.push(JSON.parse(JSON.stringify(task)));
    const world = vm.createContext({ author, formatTimestampLocal, print: () => {} });
    vm.runInContext(`"use strict";${source}\nglobalThis.JOB_TYPE = JOB_TYPE; globalThis.compileJob = compileJob;`, world);
    try {
        world.compileJob({ name: "a job", jobID, created: new Date(created), settings, addTask });
        return { status: 200, tasks, settings, type: world.JOB_TYPE };
    } catch (error) {
        // As the manager's engine writes what was thrown, and where.
        return { status: 400, message: `${error} at refuse (${path.basename(script)}:1:1(2))` };
    }
}

console.log(JSON.stringify(jobs.map(submitted)));
