// SPDX-License-Identifier: GPL-3.0-or-later
// Print the report of Khronos' validator of a .glb or .vrm file as JSON: node validate.js FOLDER_OF_NODE_MODULES FILE

const fs = require("fs");
const [folder, path] = process.argv.slice(2);
const validator = require(require.resolve("gltf-validator", { paths: [folder] }));

validator
  .validateBytes(new Uint8Array(fs.readFileSync(path)), { maxIssues: 100 })
  .then((report) => console.log(JSON.stringify(report.issues)));
