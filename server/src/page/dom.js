// Elements from names, attributes and children. A text is always a text node: nothing is read as HTML.

const SVG = 'http://www.w3.org/2000/svg';

/** Puts children into a node: nodes, texts, numbers, lists of them; nothing for null, undefined and false. */
export function put(node, ...children) {
  for (const child of children.flat(Infinity)) {
    if (child === null || child === undefined || child === false) continue;
    node.append(child instanceof Node ? child : document.createTextNode(String(child)));
  }
  return node;
}

/** Sets attributes; those that begin with "on" are listeners, `true` is an attribute without a value. */
export function set(node, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') node.addEventListener(name.slice(2), value);
    else if (value === null || value === undefined || value === false) node.removeAttribute(name);
    else node.setAttribute(name, value === true ? '' : String(value));
  }
  return node;
}

/** An HTML element. */
export function el(name, attributes = {}, ...children) {
  return put(set(document.createElement(name), attributes), children);
}

/** An SVG element. */
export function svg(name, attributes = {}, ...children) {
  return put(set(document.createElementNS(SVG, name), attributes), children);
}

/** What is said in the place of what takes a token of another role. */
export const refused = (role, what) => el('p', { class: 'refused', 'data-of': role }, `This token may not ${what}: that takes one of role ${role}.`);

/** Replaces all that is in a node. */
export function fill(node, ...children) {
  node.replaceChildren();
  return put(node, children);
}

/**
 * Makes a node's children what is given, and keeps those that look the same already, cells of rows each for itself: what is pressed,
 * focused or selected meanwhile stays. A kept child keeps its listeners too, which must not depend on when they were made.
 */
export function renew(node, ...children) {
  const wanted = [...put(document.createDocumentFragment(), children).childNodes];
  const present = [...node.childNodes];
  for (const extra of present.slice(wanted.length)) extra.remove();
  wanted.forEach((child, i) => {
    const old = present[i];
    if (!old) node.append(child);
    else if (old.nodeName === 'TR' && child.nodeName === 'TR') renew(old, [...child.childNodes]);
    else if (!old.isEqualNode(child)) old.replaceWith(child);
  });
  return node;
}

/** Replaces a node's text where it is another, so that nothing moves where nothing changed. */
export function text(node, value) {
  const now = String(value ?? '');
  if (node.textContent !== now) node.textContent = now;
  return node;
}

/** Says something at the foot of the page for a while. */
export function notice(message, kind = 'info') {
  const note = el('p', { class: `notice ${kind}` }, message);
  document.getElementById('notices').append(note);
  setTimeout(() => note.remove(), kind === 'error' ? 9000 : 4000);
}

/** Asks before something is done that cannot be undone. */
export function confirmed(question, action) {
  return new Promise((resolve) => {
    const dialog = el('dialog', { class: 'ask', 'aria-label': question, onclose: () => { dialog.remove(); resolve(dialog.returnValue === 'yes'); } },
      el('form', { method: 'dialog' },
        el('p', {}, question),
        el('div', { class: 'row end' },
          el('button', { value: 'no', autofocus: true }, 'Back'),
          el('button', { value: 'yes', class: 'danger' }, action))));
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Asks for a value; `null` where it is not given. */
export function asked(label, action, input) {
  return new Promise((resolve) => {
    const field = el('input', { id: 'asked', ...input });
    const dialog = el('dialog', { class: 'ask', 'aria-label': label, onclose: () => { dialog.remove(); resolve(dialog.returnValue === 'yes' ? field.value : null); } },
      el('form', { method: 'dialog' },
        el('label', { class: 'field' }, el('span', {}, label), field),
        el('div', { class: 'row end' },
          el('button', { value: 'no', formnovalidate: true }, 'Back'),
          el('button', { value: 'yes', class: 'primary' }, action))));
    document.body.append(dialog);
    dialog.showModal();
    field.focus();
    field.select?.();
  });
}

/** Calls `act` once the calls of it have rested for `rest` milliseconds. */
export function rested(act, rest) {
  let timer;
  return (...values) => {
    clearTimeout(timer);
    timer = setTimeout(() => act(...values), rest);
  };
}

/** Waits, or ends early where `signal` does. */
export function pause(milliseconds, signal) {
  return new Promise((resolve) => {
    const end = () => {
      clearTimeout(timer);
      signal?.removeEventListener('abort', end);
      resolve();
    };
    const timer = setTimeout(end, milliseconds);
    signal?.addEventListener('abort', end);
  });
}

/** Calls `act` now and again every `milliseconds` until `signal` ends; not while nobody looks. */
export async function repeat(milliseconds, signal, act) {
  while (!signal.aborted) {
    if (!document.hidden) await act();
    await pause(milliseconds, signal);
  }
}
