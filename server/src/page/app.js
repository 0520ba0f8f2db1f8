// Which view is shown, who is signed in, and how the farm is.

import { get, keepToken, token } from './client.js';
import { el, fill, notice, repeat, text } from './dom.js';
import { count } from './format.js';
import * as jobs from './jobs.js';

const VIEWS = {
  jobs: async () => jobs,
  job: () => import('./job.js'),
  new: () => import('./submit.js'),
  workers: () => import('./workers.js'),
};

const main = document.getElementById('main');
const sign = document.getElementById('sign');
let leaving = new AbortController();

/** `#/view/name?key=value`. */
function place() {
  const [path, query] = location.hash.replace(/^#\/?/, '').split('?');
  const [view, name] = path.split('/');
  return { view: VIEWS[view] ? view : 'jobs', name: name ? decodeURIComponent(name) : null, query: new URLSearchParams(query) };
}

async function go() {
  const { view, name, query } = place();
  leaving.abort();
  leaving = new AbortController();
  const { signal } = leaving;
  for (const link of document.querySelectorAll('nav a[data-view]')) {
    if (link.dataset.view === view || (view === 'job' && link.dataset.view === 'jobs')) link.setAttribute('aria-current', 'page');
    else link.removeAttribute('aria-current');
  }
  try {
    const module = await VIEWS[view]();
    if (signal.aborted) return;
    const root = el('div', { class: `view ${view}` });
    fill(main, root);
    window.scrollTo(0, 0);
    await module.show(root, { name, query, signal });
  } catch (error) {
    if (error.name === 'AbortError' || signal.aborted) return;
    fill(main, el('section', { class: 'panel empty' }, el('h1', {}, 'This cannot be shown'), el('p', {}, error.message), el('p', {}, el('a', { href: '#/jobs' }, 'All jobs'))));
  }
}

function signIn() {
  if (document.querySelector('dialog.sign')) return;
  const field = el('input', { type: 'password', name: 'token', autocomplete: 'off', required: true, spellcheck: 'false' });
  const dialog = el('dialog', { class: 'ask sign', 'aria-labelledby': 'sign-title', onclose: () => dialog.remove() },
    el('form', { method: 'dialog', onsubmit: () => keepToken(field.value.trim()) },
      el('h2', { id: 'sign-title' }, 'Sign in'),
      el('label', { class: 'field' }, el('span', {}, 'Token'), field),
      el('p', { class: 'hint' }, 'As ', el('code', {}, 'ovtigre token create'), ' has shown it. It is kept until this tab is closed, and nowhere else.'),
      el('div', { class: 'row end' },
        el('button', { type: 'button', onclick: () => dialog.close() }, 'Not now'),
        el('button', { class: 'primary' }, 'Sign in'))));
  document.body.append(dialog);
  dialog.showModal();
  field.focus();
}

function signed() {
  text(sign, token() ? 'Sign out' : 'Sign in');
  learn();
}

/** What the token may do: all else is hidden by the style sheet, and refused by the farm. */
async function learn() {
  const { dataset } = document.documentElement;
  const asked = token();
  const role = await get('/v1/caller').then((caller) => caller.role, () => null);
  if (token() !== asked) return;
  if (role) dataset.role = role;
  else delete dataset.role;
}

sign.addEventListener('click', () => {
  if (token()) {
    keepToken(null);
    notice('Signed out: the token is forgotten.');
  } else signIn();
});
addEventListener('ovtigre-sign-in', signIn);
addEventListener('ovtigre-token', () => {
  signed();
  go();
});
addEventListener('hashchange', go);
addEventListener('keydown', (event) => {
  const typing = event.target.closest('input, textarea, select, dialog, [data-keys]');
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === '/') {
    document.querySelector('input[type=search]')?.focus();
    event.preventDefault();
  } else if (event.key === 'n') location.hash = '#/new';
  else if (event.key === 'g') location.hash = '#/jobs';
  else if (event.key === 'w') location.hash = '#/workers';
});

/** How many work and how much waits, in a word. */
async function pulse() {
  const where = document.getElementById('pulse');
  try {
    const { active_workers: workers, batches_waiting: waiting } = await get('/v1/scaling');
    text(where, `${count(workers)} ${workers === 1 ? 'worker' : 'workers'} · ${count(waiting)} ${waiting === 1 ? 'batch' : 'batches'} waiting`);
    where.classList.toggle('bad', workers === 0 && waiting > 0);
  } catch (error) {
    text(where, error.status === 0 ? 'The farm cannot be reached' : '');
    where.classList.add('bad');
  }
}

signed();
go();
setTimeout(() => repeat(4000, new AbortController().signal, pulse), 300);
