// SPDX-License-Identifier: GPL-3.0-or-later
// A job type of Flamenco 3: frames of a .blend, rendered by the command line of Vellus. See README.md beside this file.

const JOB_TYPE = {
    label: "Vellus Render",
    description: "Frames with hair by Vellus, Cycles or EEVEE; frames that are there already are not made again",
    settings: [
        {
            key: "frames", type: "string", required: true,
            eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
            evalInfo: { showLinkButton: true, description: "Frames of the scene" },
            description: "Frames to render, such as 47, 1-30, or 3, 5-10, 47-327",
        },
        {
            key: "chunk_size", type: "int32", default: 4, propargs: { min: 1 }, visible: "submission",
            description: "How many frames a task renders",
        },
        {
            key: "pattern", type: "string", subtype: "file_path", required: true,
            default: "//frames/frame_####.exr", eval: "bpy.path.abspath(settings.pattern)",
            description: "Pictures, .exr or .png, in a folder that all workers see: #### becomes the number of a frame",
        },
        {
            key: "engine", type: "string", required: true, default: "vellus", choices: ["vellus", "cycles", "eevee"],
            description: "Who renders",
        },
        {
            key: "samples", type: "int32", default: 0, propargs: { min: 0 },
            description: "Samples of each pixel; 0: as many as the scene asks for",
        },
        { key: "passes", type: "bool", default: true, description: "All passes, as layers of the .exr" },
        { key: "transparent", type: "bool", default: false, description: "Leave the background empty" },
        {
            key: "blendfile", type: "string", required: true, visible: "web",
            description: "The .blend file, where all workers see it",
        },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const rendering = frameChunker(settings.frames, settings.chunk_size).map((chunk) => renderTask(settings, chunk));
    // The same command over all frames makes what is missing, and nothing where nothing is: the job ends with every
    // frame there, whatever became of the workers.
    const checking = renderTask(settings, settings.frames);
    checking.name = "check";
    for (const task of rendering) {
        job.addTask(task);
        checking.addDependency(task);
    }
    job.addTask(checking);
}

// A task with a command for each range of a list such as "1-4" or "3, 5-10".
function renderTask(settings, frames) {
    const task = author.Task(`render-${frames}`, "blender");
    for (const range of frames.split(",")) {
        task.addCommand(author.Command("exec", { exe: "{blender}", args: words(settings, range.trim()) }));
    }
    return task;
}

function words(settings, range) {
    const options = ["--frames", range, "--out", settings.pattern, "--engine", settings.engine];
    if (settings.samples > 0) options.push("--samples", String(settings.samples));
    if (settings.passes) options.push("--passes");
    if (settings.transparent) options.push("--transparent");
    return ["--command", "vellus", "render", settings.blendfile].concat(options);
}
