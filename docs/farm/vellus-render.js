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
            key: "pattern", type: "string", subtype: "file_path", required: true,
            default: "//frames/frame_####.exr", eval: "bpy.path.abspath(settings.pattern)",
            description: "Image files, .exr or .png, in a folder shared by all workers; #### is the frame number",
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
            key: "blendfile", type: "string", required: true, visible: "web",
            description: "The .blend file, in a folder shared by all workers",
        },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const rendering = frameChunker(settings.frames, settings.chunk_size).map((chunk) => renderTask(settings, chunk));
    // The same command for all frames renders missing ones, if any: the job ends with all frames, even if workers
    // were lost.
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
