// The interface to be read: what can be called, what it takes and gives, made from /openapi.json.

import { el, fill, text } from './dom.js';

const METHODS = ['get', 'put', 'post', 'patch', 'delete'];
const GROUPS = [['Scenes', '/v1/scenes'], ['Jobs', '/v1/jobs'], ['Workers', '/v1/workers'], ['Leases', '/v1/leases'], ['The farm', '/']];

let schemas = {};

const nameOf = (schema) => schema?.$ref?.split('/').pop();

/** A type in a few words, with links to what is described below. */
function type(schema) {
  if (schema === undefined || schema === true) return 'anything';
  const name = nameOf(schema);
  if (name) return el('a', { href: `#schema-${name}` }, name);
  const options = schema.anyOf ?? schema.oneOf;
  if (options) return between(options.map(type), ' or ');
  if (schema.allOf) return between(schema.allOf.map(type), ' and ');
  if (schema.const !== undefined) return el('code', {}, JSON.stringify(schema.const));
  if (schema.enum) return between(schema.enum.map((value) => el('code', {}, JSON.stringify(value))), ' or ');
  if (schema.type === 'array') return ['list of ', type(schema.items ?? (schema.prefixItems ?? [true])[0])];
  const kinds = [schema.type ?? 'anything'].flat();
  return between(kinds.map((kind) => (kind === 'null' ? 'nothing' : kind)), ' or ');
}

function between(items, word) {
  return items.flatMap((item, i) => (i > 0 ? [word, item] : [item]));
}

/** A description: what is between back quotes is code. */
function said(description) {
  return (description ?? '').split('`').map((part, i) => (i % 2 === 1 ? el('code', {}, part) : part));
}

/** The fields of an object. */
function fields(schema) {
  const required = new Set(schema.required ?? []);
  const rows = Object.entries(schema.properties ?? {}).map(([name, field]) => el('tr', {},
    el('th', { scope: 'row' }, el('code', {}, name), required.has(name) ? null : el('span', { class: 'under' }, 'optional')),
    el('td', {}, type(field)), el('td', {}, said(field.description))));
  return rows.length > 0 ? el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Fields' }, el('table', { class: 'plain' }, el('tbody', {}, rows))) : null;
}

function schemaPanel([name, schema]) {
  const options = schema.oneOf ?? schema.anyOf ?? [];
  return el('section', { class: 'panel', id: `schema-${name}`, 'aria-label': name }, el('h2', {}, name),
    schema.description ? el('p', {}, said(schema.description)) : null,
    schema.properties || options.length > 0 ? null : el('p', {}, type({ ...schema, description: undefined })),
    fields(schema),
    options.length > 0 ? el('ul', {}, options.map((option) => el('li', {}, type(option.properties ? { type: 'object' } : option), option.description ? [': ', said(option.description)] : '', fields(option)))) : null);
}

function media(content) {
  return Object.entries(content ?? {}).map(([name, { schema }]) => (schema && name === 'application/json' ? type(schema) : el('code', {}, name)));
}

function call(path, method, operation) {
  const id = `call-${operation.operationId}`;
  const row = (title, ...value) => [el('dt', {}, title), el('dd', {}, value)];
  const parameters = operation.parameters ?? [];
  const takes = operation.requestBody ? between(media(operation.requestBody.content), ' or ') : null;
  const gives = Object.entries(operation.responses).filter(([status]) => status !== 'default');
  const roles = operation.security?.[0]?.token;
  return el('section', { class: 'panel call', id, 'aria-label': operation.summary },
    el('h3', {}, el('span', { class: `verb ${method}` }, method.toUpperCase()), ' ', el('code', {}, path)),
    el('p', {}, operation.summary, '.'),
    el('dl', { class: 'facts' },
      parameters.map((one) => row(one.in === 'query' ? `?${one.name}=` : one.in === 'path' ? `{${one.name}}` : one.name, one.in === 'header' ? el('span', { class: 'hint' }, 'header') : type(one.schema), one.description ? [': ', said(one.description)] : '')),
      takes ? row('Takes', takes) : null,
      gives.map(([status, response]) => row(status, between(media(response.content), ' or '), response.content ? '' : response.description)),
      row('May be called by', roles ? roles.join(', ') : 'anybody')));
}

async function show() {
  const main = document.getElementById('main');
  const document_ = await (await fetch('/openapi.json')).json();
  schemas = document_.components.schemas;
  const left = new Map(Object.entries(document_.paths));
  const groups = GROUPS.map(([title, prefix]) => {
    const inside = [...left].filter(([path]) => path.startsWith(prefix));
    inside.forEach(([path]) => left.delete(path));
    const calls = inside.flatMap(([path, methods]) => METHODS.filter((method) => methods[method]).map((method) => call(path, method, methods[method])));
    return calls.length > 0 ? el('section', { class: 'group', 'aria-label': title }, el('h2', {}, title), calls) : null;
  });
  fill(main, el('div', { class: 'view docs' },
    el('div', { class: 'head' }, el('h1', {}, 'Interface'), el('a', { class: 'button', href: '/openapi.json', download: 'openapi.json' }, 'OpenAPI 3.1')),
    el('p', {}, 'JSON in, JSON out; times as RFC 3339, durations in seconds. What goes wrong is told as ', el('a', { href: '#schema-Problem' }, 'a problem document'), ' (RFC 9457). Lists have pages: ', el('code', {}, 'next'), ' of one is the ', el('code', {}, 'cursor'), ' of the next. Where the farm has tokens, each call carries ', el('code', {}, 'Authorization: Bearer TOKEN'), '.'),
    groups, el('section', { class: 'group', 'aria-label': 'Documents' }, el('h2', {}, 'Documents'), Object.entries(schemas).map(schemaPanel))));
  text(document.querySelector('title'), `Interface ${document_.info.version} · ovtigre`);
  if (location.hash) document.querySelector(location.hash)?.scrollIntoView();
}

show();
