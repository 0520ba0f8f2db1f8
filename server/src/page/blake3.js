// BLAKE3, the plain hash of 32 bytes, after the paper by O'Connor, Aumasson, Neves and Wilcox-O'Hearn (2020), §2.

const IV = Uint32Array.of(0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19);
const CHUNK = 1024;
const BLOCK = 64;
const CHUNK_START = 1;
const CHUNK_END = 2;
const PARENT = 4;
const ROOT = 8;

// Which word of the message each half of each quarter takes, in all seven rounds (table 2, applied again and again).
const SCHEDULE = schedule();

function schedule() {
  const permutation = [2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8];
  let order = [...Array(16).keys()];
  const all = [];
  for (let round = 0; round < 7; round += 1) {
    all.push(...order);
    order = permutation.map((i) => order[i]);
  }
  return Uint8Array.from(all);
}

const v = new Uint32Array(16);

function quarter(a, b, c, d, x, y) {
  let va = (v[a] + v[b] + x) | 0;
  let vd = v[d] ^ va;
  vd = (vd >>> 16) | (vd << 16);
  let vc = (v[c] + vd) | 0;
  let vb = v[b] ^ vc;
  vb = (vb >>> 12) | (vb << 20);
  va = (va + vb + y) | 0;
  vd ^= va;
  vd = (vd >>> 8) | (vd << 24);
  vc = (vc + vd) | 0;
  vb ^= vc;
  v[a] = va;
  v[b] = (vb >>> 7) | (vb << 25);
  v[c] = vc;
  v[d] = vd;
}

/** The compression function: the new chaining value of `cv` and the 16 words of `m` at `at`. */
function compress(cv, m, at, counter, length, flags) {
  v.set(cv);
  v[8] = IV[0];
  v[9] = IV[1];
  v[10] = IV[2];
  v[11] = IV[3];
  v[12] = counter;
  v[13] = counter / 4294967296;
  v[14] = length;
  v[15] = flags;
  for (let r = 0; r < 112; r += 16) {
    const s = SCHEDULE;
    quarter(0, 4, 8, 12, m[at + s[r]], m[at + s[r + 1]]);
    quarter(1, 5, 9, 13, m[at + s[r + 2]], m[at + s[r + 3]]);
    quarter(2, 6, 10, 14, m[at + s[r + 4]], m[at + s[r + 5]]);
    quarter(3, 7, 11, 15, m[at + s[r + 6]], m[at + s[r + 7]]);
    quarter(0, 5, 10, 15, m[at + s[r + 8]], m[at + s[r + 9]]);
    quarter(1, 6, 11, 12, m[at + s[r + 10]], m[at + s[r + 11]]);
    quarter(2, 7, 8, 13, m[at + s[r + 12]], m[at + s[r + 13]]);
    quarter(3, 4, 9, 14, m[at + s[r + 14]], m[at + s[r + 15]]);
  }
  const out = new Uint32Array(8);
  for (let i = 0; i < 8; i += 1) out[i] = v[i] ^ v[i + 8];
  return out;
}

/** A hash that is fed piece by piece. */
export class Blake3 {
  #stack = [];
  #chunks = 0;
  #buffer = new Uint8Array(CHUNK);
  #words = new Uint32Array(CHUNK / 4);
  #view = new DataView(this.#buffer.buffer);
  #filled = 0;

  /** Takes up more bytes. */
  update(bytes) {
    let at = 0;
    while (at < bytes.length) {
      // The last chunk is kept: only the end tells whether it is the root.
      if (this.#filled === CHUNK) this.#add(this.#chunk(CHUNK, 0));
      const n = Math.min(CHUNK - this.#filled, bytes.length - at);
      this.#buffer.set(bytes.subarray(at, at + n), this.#filled);
      this.#filled += n;
      at += n;
    }
    return this;
  }

  #chunk(length, root) {
    this.#buffer.fill(0, length);
    for (let i = 0; i < CHUNK / 4; i += 1) this.#words[i] = this.#view.getUint32(4 * i, true);
    const blocks = Math.max(1, Math.ceil(length / BLOCK));
    let cv = IV;
    for (let b = 0; b < blocks; b += 1) {
      const last = b === blocks - 1;
      const flags = (b === 0 ? CHUNK_START : 0) | (last ? CHUNK_END | root : 0);
      cv = compress(cv, this.#words, 16 * b, this.#chunks, last ? length - BLOCK * b : BLOCK, flags);
    }
    return cv;
  }

  /** Puts a whole chunk under the tree: as many parents are made as its number has trailing ones (§5.1.2). */
  #add(cv) {
    this.#chunks += 1;
    this.#filled = 0;
    let value = cv;
    for (let n = this.#chunks; n % 2 === 0; n /= 2) value = parent(this.#stack.pop(), value, 0);
    this.#stack.push(value);
  }

  /** The hash of all bytes so far, as 64 hexadecimal digits. */
  hex() {
    let value = this.#chunk(this.#filled, this.#stack.length === 0 ? ROOT : 0);
    for (let i = this.#stack.length - 1; i >= 0; i -= 1) value = parent(this.#stack[i], value, i === 0 ? ROOT : 0);
    const bytes = new DataView(new ArrayBuffer(32));
    value.forEach((word, i) => bytes.setUint32(4 * i, word, true));
    return [...new Uint8Array(bytes.buffer)].map((b) => b.toString(16).padStart(2, '0')).join('');
  }
}

function parent(left, right, root) {
  const words = new Uint32Array(16);
  words.set(left);
  words.set(right, 8);
  return compress(IV, words, 0, 0, BLOCK, PARENT | root);
}

/** The hash of a blob, read in pieces; `progress` is told the part that is read. */
export async function hashOf(blob, progress = () => {}) {
  const hash = new Blake3();
  const piece = 1 << 20;
  for (let at = 0; at < blob.size; at += piece) {
    hash.update(new Uint8Array(await blob.slice(at, at + piece).arrayBuffer()));
    progress(Math.min(1, (at + piece) / blob.size));
  }
  return hash.hex();
}
