// What a user drops or chooses, as one file to upload.

import { zipOf } from './zip.js';

const ALONE = /\.(glb|zip|gltf|exr|hdr)$/i;
const FILES_MAX = 10000;

/** All files below dropped items, with their paths. */
export async function dropped(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return [...transfer.files].map((file) => ({ path: file.name, file }));
  const found = [];
  for (const entry of entries) await walk(entry, '', found);
  return found;
}

async function walk(entry, folder, found) {
  if (found.length >= FILES_MAX) throw new Error(`there are more than ${FILES_MAX} files in this folder`);
  const path = folder + entry.name;
  if (entry.isFile) {
    found.push({ path, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    for (const inner of some) await walk(inner, `${path}/`, found);
  }
}

/** All files of a file input. */
export const chosen = (input) => [...input.files].map((file) => ({ path: file.webkitRelativePath || file.name, file }));

/** One file of several: alone as it is, a folder with a .gltf as an archive whose paths begin at that. */
export async function packed(files) {
  const shown = files.filter(({ path }) => !path.split('/').some((part) => part.startsWith('.')));
  if (shown.length === 0) throw new Error('there is no file here');
  if (shown.length === 1 && ALONE.test(shown[0].path)) return { name: shown[0].file.name, blob: shown[0].file };
  const scenes = shown.filter(({ path }) => /\.(gltf|glb)$/i.test(path));
  if (scenes.length === 0) throw new Error('there is no .glb, .gltf or .zip among these files');
  if (scenes.length > 1) throw new Error(`there are ${scenes.length} scenes here: choose one of them`);
  const [scene] = scenes;
  if (/\.glb$/i.test(scene.path)) return { name: scene.file.name, blob: scene.file };
  const folder = scene.path.slice(0, scene.path.lastIndexOf('/') + 1);
  const inside = shown.filter(({ path }) => path.startsWith(folder));
  const blob = await zipOf(inside.map(({ path, file }) => ({ path: path.slice(folder.length), file })));
  return { name: scene.file.name.replace(/\.gltf$/i, '.zip'), blob };
}
