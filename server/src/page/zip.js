// A ZIP archive of stored files (APPNOTE 6.3.3), the same bytes for the same files: names in order, no times.

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});

/** CRC-32 of a blob, read in pieces. */
async function crcOf(blob) {
  let crc = 0xffffffff;
  const piece = 1 << 20;
  for (let at = 0; at < blob.size; at += piece) {
    for (const byte of new Uint8Array(await blob.slice(at, at + piece).arrayBuffer())) crc = TABLE[(crc ^ byte) & 255] ^ (crc >>> 8);
  }
  return (crc ^ 0xffffffff) >>> 0;
}

/** Little-endian numbers of given sizes in bytes. */
function numbers(...pairs) {
  const view = new DataView(new ArrayBuffer(pairs.reduce((sum, [, size]) => sum + size, 0)));
  let at = 0;
  for (const [value, size] of pairs) {
    if (size === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
    at += size;
  }
  return view.buffer;
}

// 1 January 1980, the first date that an archive can tell.
const DATE = 0x21;
const UTF8 = 0x800;

/** An archive of `{ path, file }`. */
export async function zipOf(files) {
  const parts = [];
  const directory = [];
  let at = 0;
  const sorted = [...files].sort((a, b) => (a.path < b.path ? -1 : 1));
  for (const { path, file } of sorted) {
    const name = new TextEncoder().encode(path);
    const crc = await crcOf(file);
    const shared = [[20, 2], [UTF8, 2], [0, 2], [0, 2], [DATE, 2], [crc, 4], [file.size, 4], [file.size, 4], [name.length, 2], [0, 2]];
    const header = numbers([0x04034b50, 4], ...shared);
    parts.push(header, name, file);
    directory.push(numbers([0x02014b50, 4], [20, 2], ...shared, [0, 2], [0, 2], [0, 2], [0, 4], [at, 4]), name);
    at += header.byteLength + name.length + file.size;
    if (at > 0xfffffffe) throw new Error('the folder has more than 4 GB: send a .glb or a .zip of your own');
  }
  const size = directory.reduce((sum, piece) => sum + piece.byteLength, 0);
  const n = sorted.length;
  const end = numbers([0x06054b50, 4], [0, 2], [0, 2], [n, 2], [n, 2], [size, 4], [at, 4], [0, 2]);
  return new Blob([...parts, ...directory, end]);
}
