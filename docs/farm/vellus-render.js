// SPDX-License-Identifier: GPL-3.0-or-later
// A job type of Flamenco 3: frames of a .blend, rendered by the command line of Vellus. See README.md beside this file.

const JOB_TYPE = {
    label: "Vellus Render",
    description: "Render frames with hair by Vellus, Cycles or EEVEE; existing frames are kept",
    settings: [
        {
            key: "frames", type: "string", required: true,
            eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
            evalInfo: { showLinkButton: true, description: "Frames of the scene" },
            description: "Frames to render, such as 47, 1-30, or 3, 5-10, 47-327",
        },
        {
            key: "chunk_size", type: "int32", default: 4, propargs: { min: 1 }, visible: "submission",
            description: "Number of frames per task",
        },
        {
            key: "output_root", type: "string", subtype: "dir_path", required: true, default: "//frames",
            visible: "submission",
            description: "Folder shared by all workers, in which each job makes one of its own; // is the .blend's folder",
        },
        {
            key: "file_name", type: "string", required: true, default: "frame_####.exr", visible: "submission",
            description: "Name of the images, .exr or .png; #### is the frame number",
        },
        {
            // The add-on evaluates a setting that is not editable when the job is submitted, as it is then.
            key: "pattern", type: "string", subtype: "file_path", required: true, editable: false,
            eval: "str(Path(abspath(settings.output_root), jobname, '{timestamp}', settings.file_name))",
            description: "Image files of the job",
        },
        {
            key: "engine", type: "string", required: true, default: "vellus", choices: ["vellus", "cycles", "eevee"],
            description: "Render engine",
        },
        {
            key: "samples", type: "int32", default: 0, propargs: { min: 0 },
            description: "Samples per pixel; 0 uses the scene's setting",
        },
        { key: "passes", type: "bool", default: true, description: "Write all passes as layers of the .exr" },
        { key: "transparent", type: "bool", default: false, description: "Render a transparent background" },
        {
            key: "simulate", type: "bool", default: true,
            description: "Bake guides with dynamics in one task before the frames; baked frames are kept",
        },
        {
            key: "enable_scripts", type: "bool", default: false,
            description: "Run the scripts and drivers of the .blend file",
        },
        {
            key: "blendfile", type: "string", required: true, visible: "web",
            description: "The .blend file, in a folder shared by all workers",
        },
    ],
};

function compileJob(job) {
    const settings = withDefaults(job.settings);
    const ranges = frameRanges(settings.frames);
    settings.pattern = settings.pattern.replaceAll("{timestamp}", folderOf(job));
    requireSettings(settings, frameCountOf(ranges));
    job.settings.pattern = settings.pattern; // for the manager's page of the job

    const rendering = chunks(ranges, settings.chunk_size).map((chunk) => renderTask(settings, chunk));
    if (settings.simulate) {
        const simulating = simulateTask(settings, ranges);
        job.addTask(simulating);
        rendering.forEach((task) => task.addDependency(simulating));
    }
    rendering.forEach((task) => job.addTask(task));
    if (rendering.length > 1) {
        // The same command for all frames renders missing ones, if any: the job ends with all frames, even if workers
        // were lost.
        const checking = renderTask(settings, ranges);
        checking.name = "check";
        rendering.forEach((task) => checking.addDependency(task));
        job.addTask(checking);
    }
}

// Settings are as submitted: a script may leave out those that have a default.
function withDefaults(submitted) {
    const settings = {};
    for (const { key, type, default: value } of JOB_TYPE.settings) {
        settings[key] = key in submitted ? submitted[key] : value;
        if (settings[key] === undefined) refuse(`The setting ${key} is missing.`);
        if (type === "string") settings[key] = String(settings[key]);
    }
    return settings;
}

// The folder of a job's images: the same .blend submitted twice is two jobs, whose images are not mixed.
function folderOf(job) {
    return `${formatTimestampLocal(job.created)}-${job.jobID.slice(0, 4)}`;
}

// ------------------------------------------------------------------------------------------------------------- frames

const FIRST_FRAME = -1048574, LAST_FRAME = 1048574;

// Ranges [first, last] of a list such as "1-4", "3, 5 - 10" or "1..6", in order and merged.
function frameRanges(text) {
    const list = text.replace(/\s*\.\.\s*/g, "-").replace(/\s*([-,])\s*/g, "$1").trim();
    const ranges = list.split(",").map(frameRange).sort((one, other) => one[0] - other[0]);
    const merged = [ranges[0]];
    for (const [first, last] of ranges.slice(1)) {
        const before = merged[merged.length - 1];
        if (first <= before[1] + 1) before[1] = Math.max(before[1], last);
        else merged.push([first, last]);
    }
    return merged;
}

// The rules and sentences of --frames; a test compares them.
function frameRange(text) {
    const match = /^(-?\d{1,7})(?:-(-?\d{1,7}))?$/.exec(text);
    if (!match) refuse(`'${text}' is not a frame, or a range such as 1-24`);
    const first = Number(match[1]), last = Number(match[2] || match[1]);
    if (Math.min(first, last) < FIRST_FRAME || Math.max(first, last) > LAST_FRAME) {
        refuse(`${text} is outside Blender's frame range, ${FIRST_FRAME} to ${LAST_FRAME}`);
    }
    if (last < first) refuse(`${text} is an empty range: the first frame is after the last`);
    return [first, last];
}

function frameCountOf(ranges) {
    return ranges.reduce((sum, [first, last]) => sum + last - first + 1, 0);
}

// Lists of ranges with `size` frames each; the last one may have fewer.
function chunks(ranges, size) {
    const made = [];
    let room = 0;
    for (const [first, last] of ranges) {
        for (let start = first; start <= last;) {
            if (room === 0) {
                made.push([]);
                room = size;
            }
            const end = Math.min(last, start + room - 1);
            made[made.length - 1].push([start, end]);
            room -= end - start + 1;
            start = end + 1;
        }
    }
    return made;
}

function rangeText([first, last]) {
    return first === last ? `${first}` : `${first}-${last}`;
}

// ------------------------------------------------------------------------------------------------------------ refusals

// What a submitted job is refused with: HTTP status 400, and a sentence that Blender shows.
function refuse(sentence) {
    throw sentence;
}

function requireSettings(settings, frameCount) {
    const { pattern, blendfile, chunk_size, samples, engine } = settings;
    if (!/\.blend$/i.test(blendfile)) refuse(`${blendfile} is not a .blend file.`);
    if (!(Number.isInteger(chunk_size) && chunk_size > 0)) refuse("Chunk Size must be a whole number from 1.");
    if (!(Number.isInteger(samples) && samples >= 0)) refuse("Samples must be a whole number from 0.");
    const engines = JOB_TYPE.settings.find((setting) => setting.key === "engine").choices;
    if (!engines.includes(engine)) refuse(`Engine must be ${engines.join(", ")}, not ${engine}.`);
    // A variable of the manager, such as {render}, stands for a path.
    if (!/^(\/(?!\/)|[A-Za-z]:[\\/]|\\\\|\{\w+\})/.test(pattern)) {
        refuse(`${pattern} is not an absolute path: workers would write to folders of their own.`);
    }
    requirePattern(pattern, frameCount, settings.passes);
}

// The rules and sentences of --out; a test compares them.
function requirePattern(text, frameCount, hasPasses) {
    const pattern = text.replace(/(\/\.?)+$/, "");
    const isWindows = !pattern.startsWith("/");
    const name = pattern.split(isWindows ? /[\\/]/ : "/").pop();
    const dot = name.lastIndexOf(".");
    const suffix = dot > 0 && dot < name.length - 1 ? name.slice(dot) : "";
    if (![".png", ".exr"].includes(suffix.toLowerCase())) {
        refuse(`Pictures are saved as .png or .exr, not as ${suffix || "a file without an extension"}.`);
    }
    if (hasPasses && suffix.toLowerCase() !== ".exr") {
        refuse(`Passes are layers of an .exr file: change the extension of ${pattern}.`);
    }
    if (!isWindows && pattern.includes("\\")) {
        refuse(`${pattern} has a backslash, which Blender treats as a path separator: choose another path.`);
    }
    if (frameCount > 1 && !name.includes("#")) {
        refuse(`${pattern} is a single file for ${frameCount} frames: add #### for the frame number.`);
    }
}

// --------------------------------------------------------------------------------------------------------------- tasks

function simulateTask(settings, ranges) {
    const last = ranges[ranges.length - 1][1];
    const task = author.Task("simulate", "blender");
    task.addCommand(command(settings, ["simulate", settings.blendfile, "--if-needed", `--last-frame=${last}`]));
    return task;
}

// A task with a command for each range of frames.
function renderTask(settings, ranges) {
    const task = author.Task(`render-${ranges.map(rangeText).join(",")}`, "blender");
    for (const range of ranges) {
        const words = ["render", settings.blendfile, `--frames=${rangeText(range)}`, `--out=${settings.pattern}`];
        words.push(`--engine=${settings.engine}`);
        if (settings.samples > 0) words.push(`--samples=${settings.samples}`);
        if (settings.passes) words.push("--passes");
        if (settings.transparent) words.push("--transparent");
        task.addCommand(command(settings, words));
    }
    return task;
}

function command(settings, words) {
    const scripts = settings.enable_scripts ? ["--enable-scripts"] : [];
    return author.Command("exec", { exe: "{blender}", args: ["--command", "vellus"].concat(words, scripts) });
}
