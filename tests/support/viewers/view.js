// SPDX-License-Identifier: GPL-3.0-or-later
// Load model.glb, step its springs at rest, in motion and at rest again, and draw it in motion.

import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { VRMLoaderPlugin } from "@pixiv/three-vrm";

const STEP = 1 / 60;

function bonesOfHair(model) {
  const found = [];
  model.traverse((node) => node.isBone && node.name.endsWith("_end") && found.push(node));
  return found;
}

// Places of nodes relative to the model, so that its own motion does not count.
function places(nodes, model) {
  model.updateWorldMatrix(true, true);
  return nodes.map((node) => model.worldToLocal(node.getWorldPosition(new THREE.Vector3())));
}

const farthest = (some, others) => Math.max(0, ...some.map((place, index) => place.distanceTo(others[index])));

async function main() {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMLoaderPlugin(parser));
  const gltf = await loader.loadAsync("model.glb");
  const model = gltf.scene;
  const springs = gltf.userData.vrm?.springBoneManager ?? gltf.userData.vrmSpringBoneManager;
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0.5, 0.5, 0.5);
  scene.add(model, new THREE.HemisphereLight(0xffffff, 0x404040, 1), new THREE.DirectionalLight(0xffffff, 2));
  const update = (count, shift = 0) => {
    for (let step = 0; step < count; step++) {
      model.position.x += shift;
      model.updateWorldMatrix(true, true);
      springs?.update(STEP);
    }
  };
  model.traverse((node) => (node.frustumCulled = false)); // bounds do not follow the bones
  model.updateWorldMatrix(true, true);
  const box = new THREE.Box3().setFromObject(model);
  const size = box.getSize(new THREE.Vector3()).length();
  const tips = bonesOfHair(model);
  const rest = places(tips, model);
  update(60);
  const atRest = farthest(rest, places(tips, model));
  update(20, 0.015 * size);
  const swung = farthest(rest, places(tips, model));

  const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setSize(480, 480);
  const middle = box.getCenter(new THREE.Vector3()).add(model.position);
  const camera = new THREE.PerspectiveCamera(35, 1, 0.01 * size, 10 * size);
  camera.position.copy(middle).add(new THREE.Vector3(0.4, 0.3, 1.4).multiplyScalar(size));
  camera.lookAt(middle);
  renderer.render(scene, camera);
  const picture = renderer.domElement.toDataURL("image/png");
  const { triangles } = renderer.info.render;

  update(1200);
  const back = farthest(rest, places(tips, model));
  const joints = springs ? springs.joints.size : 0;
  return { size, tips: tips.length, joints, atRest, swung, back, triangles, isVrm: Boolean(gltf.userData.vrm), picture };
}

// The browser's virtual time could end before pictures are decoded, so the page tells when it is done.
const send = (found) => fetch("found", { method: "POST", body: JSON.stringify(found) });
main().then(send, (error) => send({ error: String(error) }));
