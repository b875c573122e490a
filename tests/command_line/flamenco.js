// SPDX-License-Identifier: GPL-3.0-or-later
// What a manager of Flamenco 3 gives a job type, as far as ours uses it: settings (JSON) in, tasks (JSON) out.
const fs = require("fs");
const vm = require("vm");

const [script, settings] = process.argv.slice(2);
const tasks = [];

// Ranges of at most `size` frames of a list such as "1-5, 9".
function frameChunker(frames, size) {
    const numbers = frames.split(",").flatMap((part) => {
        const [first, last] = part.split("-").map(Number);
        return Array.from({ length: (last || first) - first + 1 }, (_, index) => first + index);
    });
    const chunks = [];
    for (let start = 0; start < numbers.length; start += size) {
        const some = numbers.slice(start, start + size);
        const ranges = [];
        for (const number of some) {
            const range = ranges[ranges.length - 1];
            if (range && range[1] === number - 1) range[1] = number;
            else ranges.push([number, number]);
        }
        chunks.push(ranges.map(([first, last]) => (first === last ? `${first}` : `${first}-${last}`)).join(","));
    }
    return chunks;
}

const author = {
    Task: (name, type) => ({
        name, type, commands: [], waits: [],
        addCommand(command) { this.commands.push(command); },
        addDependency(task) { this.waits.push(task); },
    }),
    Command: (name, parameters) => ({ name, parameters }),
};
const world = vm.createContext({ author, frameChunker, print: () => {} });
vm.runInContext(fs.readFileSync(script, "utf8") + "\nthis.JOB_TYPE = JOB_TYPE;", world);
const given = JSON.parse(settings);
for (const setting of world.JOB_TYPE.settings) {
    if (!(setting.key in given) && "default" in setting) given[setting.key] = setting.default;
}
world.compileJob({ settings: given, addTask: (task) => tasks.push(task) });
const told = tasks.map((task) => ({ ...task, waits: task.waits.map((other) => other.name) }));
console.log(JSON.stringify({ type: world.JOB_TYPE, tasks: told }));
