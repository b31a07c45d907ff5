// Beside the picture: what is selected and what it may be, the doubts, the segments with their markers, the text.
import { colourOf } from './cloud.js';

const by = (id) => document.getElementById(id);
// How many other markers and segments are offered.
const MATES = 6;
const SEGMENTS = 4;
const NOT_PLACED = 'not placed';
const IGNORED = 'left out on purpose';

/** A name out of a file as it may be shown: nothing in it that hides, or turns the direction of writing. */
export function plain(text) {
  return text.replace(/[\p{Cc}\p{Cf}\p{Cs}]/gu, '\ufffd');
}

export function millimetres(metres) {
  return Number.isNaN(metres) ? '–' : `${(1000 * metres).toFixed(1)} mm`;
}

/** An element with its properties and children; strings become text, never markup. */
function element(tag, properties = {}, ...children) {
  const { dataset, ...rest } = properties;
  const made = Object.assign(document.createElement(tag), rest);
  Object.assign(made.dataset, dataset);
  made.append(...children);
  return made;
}

function swatch(segment) {
  const made = element('span', { className: 'swatch' });
  if (segment >= 0) made.style.background = colourOf(segment);
  return made;
}

export class Panel {
  constructor(editor) {
    this.editor = editor;
    this.about = editor.data.about;
    this.order = new Map(this.about.segments.map(({ name }, i) => [name, i]));
    this.closed = new Set();
    for (const kind of ['keydown', 'pointerdown']) addEventListener(kind, () => { this.byKeys = kind === 'keydown'; }, { capture: true });
    by('text').addEventListener('toggle', () => this.#text());
    by('copy').addEventListener('click', () => {
      by('written').select();
      navigator.clipboard?.writeText(by('written').value).catch(() => {});
    });
  }

  show() {
    const held = document.activeElement;
    this.#counts();
    this.#chosen();
    this.#doubts();
    this.#segments();
    this.#text();
    // Who goes through the list by keys stays where they were.
    const [key, value] = Object.entries(held.dataset ?? {})[0] ?? [];
    if (held.isConnected || !this.byKeys || !key) return;
    [...document.querySelectorAll(`button[data-${key}]`)].find((one) => one.dataset[key] === value)?.focus();
  }

  #own() {
    const { subject } = this.editor;
    return this.about.markers.map((_, i) => i).filter((i) => this.about.markers[i].subject === subject);
  }

  #counts() {
    const { assignment } = this.editor;
    const own = this.#own();
    const placed = own.filter((i) => assignment.now[i].segment).length;
    const ignored = own.filter((i) => assignment.now[i].ignored).length;
    const open = own.length - placed - ignored;
    const parts = [`${placed} of ${own.length} markers placed`];
    if (open) parts.push(`${open} not placed`);
    if (ignored) parts.push(`${ignored} left out`);
    by('counts').textContent = parts.join(' · ');
    by('undo').disabled = !assignment.past.length;
    by('save').textContent = `Save ${this.editor.fileName}`;
    by('state').textContent = this.editor.state(this.editor.subject);
  }

  #chosen() {
    const { selected } = this.editor;
    const box = by('chosen');
    const markers = [...selected];
    by('change').replaceChildren(...this.editor.said.map((line) => element('p', {}, plain(line))));
    if (!markers.length) {
      box.replaceChildren(...this.#next(), element('p', { className: 'dim' },
        'Pick a marker in the picture or in the list. With shift, or with “several”, you pick more, or draw a box around them.'));
      return;
    }
    const one = markers.length === 1 ? markers[0] : -1;
    const parts = [this.#title(markers)];
    const stuck = markers.filter((i) => !this.editor.assignment.writable(i));
    if (stuck.length) {
      parts.push(element('p', { className: 'warn' },
        `${stuck.length === 1 ? 'This label' : `${stuck.length} of these labels`} cannot stand in an association file (quotes, control characters, blanks at an end): rename it in the clip.`));
    }
    if (stuck.length < markers.length) {
      if (one >= 0) parts.push(this.#nameField(one));
      parts.push(this.#segmentField(markers), this.#buttons(markers));
      if (one >= 0) parts.push(...this.#offered(one));
      parts.push(...this.#fits(markers), ...(one >= 0 ? this.#mates(one) : []));
    }
    box.replaceChildren(...parts);
  }

  /** What to do next: words, and a button that begins with it. */
  #next() {
    const { editor, about } = this;
    const { now } = editor.assignment;
    const own = this.#own();
    const open = own.filter((i) => about.markers[i].seen && !now[i].segment && !now[i].ignored);
    const doubt = about.doubts.findIndex((_, k) => this.#openDoubt(k));
    const placed = own.some((i) => now[i].segment);
    const begin = (words, markers, button) => {
      const made = element('button', { type: 'button', id: 'next' }, button);
      made.addEventListener('click', () => editor.select(markers));
      return [element('p', { id: 'step' }, words), element('p', { className: 'row' }, made)];
    };
    if (!placed && open.length) {
      const groups = open.map((i) => open.filter((j) => about.markers[j].group >= 0 && about.markers[j].group === about.markers[i].group));
      const largest = groups.reduce((best, group) => (group.length > best.length ? group : best), open.slice(0, 1));
      const several = largest.length > 1;
      return begin(
        `No label is known yet. Begin with ${several ? `these ${largest.length} markers, which move together` : 'one marker'}: see where on the body ${several ? 'they are' : 'it is'}, then choose the segment.`,
        largest, several ? `Select the ${largest.length}` : 'Select it');
    }
    if (doubt >= 0) {
      const markers = about.doubts[doubt].markers.filter((i) => about.markers[i].subject === editor.subject);
      return begin('Next: the first doubt below. See whether the marker sits where its name says; if not, choose another name or segment.', markers, 'Show it');
    }
    if (open.length) {
      return begin(`Next: ${open.length === 1 ? 'one marker is' : `${open.length} markers are`} not placed. Choose a segment, or leave out on purpose what is no marker of the body.`, open.slice(0, 1), `Show ${plain(about.markers[open[0]].label)}`);
    }
    return [element('p', { id: 'step' }, editor.state(editor.subject) === 'saved' ? 'All is placed and saved: fit with this file.' : 'All is placed: save the file.')];
  }

  /** Whether a doubt is of this subject and not decided. */
  #openDoubt(k) {
    const { editor, about } = this;
    const own = about.doubts[k].markers.filter((i) => about.markers[i].subject === editor.subject);
    return own.length > 0 && !editor.settled.has(k) && !own.some((i) => editor.assignment.changed(i));
  }

  #title(markers) {
    const { assignment } = this.editor;
    if (markers.length > 1) {
      const names = markers.slice(0, 12).map((i) => plain(this.about.markers[i].label)).join(', ');
      return element('h3', {}, `${markers.length} markers: ${names}${markers.length > 12 ? ' …' : ''}`);
    }
    const { label, seen } = this.about.markers[markers[0]];
    const { marker, segment, ignored } = assignment.now[markers[0]];
    const is = segment ? `${marker === label ? '' : `${plain(marker)}, `}${plain(segment)}` : ignored ? IGNORED : NOT_PLACED;
    return element('h3', {}, swatch(this.order.get(segment) ?? -1), `${plain(label)} `,
      element('small', {}, `${is}${seen ? '' : ' · never seen in the clip'}`));
  }

  #nameField(i) {
    const { editor, about } = this;
    const list = element('datalist', { id: 'standard' });
    for (const { name, markers } of about.segments) {
      for (const marker of markers) {
        const holder = editor.assignment.holder(marker, editor.subject);
        const taken = holder >= 0 && holder !== i ? ` · now ${plain(about.markers[holder].label)}` : '';
        list.append(element('option', { value: marker, label: `${plain(name)}${taken}` }));
      }
    }
    const field = element('input', {
      type: 'text', id: 'name', value: plain(editor.assignment.now[i].marker), placeholder: 'search a marker name', autocomplete: 'off', spellcheck: false,
    });
    field.setAttribute('list', 'standard');
    // A field that already holds a name would offer that name alone.
    field.addEventListener('focus', () => field.select());
    field.addEventListener('change', () => { if (field.value.trim()) editor.name(i, field.value); });
    return element('label', { className: 'field' }, element('span', {}, 'Marker'), field, list);
  }

  #segmentField(markers) {
    const { editor, about } = this;
    const now = new Set(markers.map((i) => editor.assignment.now[i].segment));
    const choice = element('select', { id: 'segment' },
      new Option(now.size > 1 ? 'several' : NOT_PLACED, ''), ...about.segments.map(({ name }) => new Option(plain(name), name)));
    choice.value = now.size === 1 ? [...now][0] : '';
    choice.addEventListener('change', () => editor.place(choice.value));
    return element('label', { className: 'field' }, element('span', {}, 'Segment'), choice);
  }

  #buttons(markers) {
    const { editor } = this;
    const button = (id, words, act) => {
      const made = element('button', { id, type: 'button' }, words);
      made.addEventListener('click', act);
      return made;
    };
    return element('p', { className: 'row' },
      ...(markers.length === 2 ? [button('exchange', 'Exchange the two', () => editor.exchange())] : []),
      button('ignore', 'Leave out on purpose', () => editor.ignore()), button('unplace', 'Not placed', () => editor.place('')));
  }

  #offered(i) {
    const { editor, about } = this;
    const { offered, reason } = about.markers[i];
    const parts = [];
    if (reason) parts.push(element('p', { className: 'dim' }, `The guess: ${plain(reason)}.`));
    if (offered.length && !editor.assignment.now[i].segment) {
      const [marker, segment] = offered;
      const take = element('button', { id: 'take', type: 'button' }, `Take ${plain(marker)}, ${plain(segment)}`);
      take.addEventListener('click', () => (editor.assignment.segmentOf.has(marker) ? editor.name(i, marker) : editor.place(segment)));
      parts.push(element('p', { className: 'row' }, take));
    }
    return parts;
  }

  /** The segments with which the selected markers move best, each to be chosen. */
  #fits(markers) {
    const { editor, about } = this;
    const found = about.segments.map(({ name }) => {
      const members = editor.assignment.members(name, editor.subject).filter((j) => !markers.includes(j));
      const values = markers.map((i) => editor.rigidity.toward(i, members)).filter((value) => !Number.isNaN(value));
      return { name, value: values.length ? Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length) : NaN };
    }).filter(({ value }) => !Number.isNaN(value)).sort((a, b) => a.value - b.value).slice(0, SEGMENTS);
    if (!found.length) return [];
    const chips = found.map(({ name, value }) => {
      const chip = element('button', { type: 'button', className: 'chip', dataset: { fit: name } },
        swatch(this.order.get(name)), `${plain(name)} `, element('small', {}, millimetres(value)));
      chip.addEventListener('click', () => editor.place(name));
      return chip;
    });
    return [element('p', { className: 'head' }, `${markers.length > 1 ? 'Their' : 'Its'} distances vary least to the markers of`), element('p', { className: 'row' }, ...chips)];
  }

  /** The markers that move with this one. */
  #mates(i) {
    const { editor, about } = this;
    const { spread } = editor.rigidity.row(i);
    const own = this.#own().filter((j) => !Number.isNaN(spread[j]));
    const near = own.sort((a, b) => spread[a] - spread[b]).slice(0, MATES);
    const group = this.#own().filter((j) => about.markers[j].group >= 0 && about.markers[j].group === about.markers[i].group);
    if (!near.length) return [];
    const chips = near.map((j) => {
      const chip = element('button', { type: 'button', className: 'chip' },
        swatch(this.order.get(editor.assignment.now[j].segment) ?? -1), `${plain(about.markers[j].label)} `, element('small', {}, millimetres(spread[j])));
      chip.addEventListener('click', () => editor.pick(j, true));
      return chip;
    });
    const parts = [element('p', { className: 'head' }, 'It keeps its distance best to'), element('p', { className: 'row' }, ...chips)];
    if (group.length > 1) {
      const all = element('button', { type: 'button', id: 'mates' }, `Select the ${group.length} that move together`);
      all.addEventListener('click', () => editor.select(group));
      parts.push(element('p', { className: 'row' }, all));
    }
    return parts;
  }

  #doubts() {
    const { editor, about } = this;
    const { subject, assignment, settled, selected } = editor;
    const mine = about.doubts.map((doubt, k) => [doubt, k]).filter(([{ markers }]) => markers.some((i) => about.markers[i].subject === subject));
    const rows = mine.map(([{ markers, words }, k]) => {
      const own = markers.filter((i) => about.markers[i].subject === subject);
      const decided = settled.has(k) || own.some((i) => assignment.changed(i));
      const tick = element('input', { type: 'checkbox', checked: decided, title: 'Decided' });
      tick.setAttribute('aria-label', 'Decided');
      tick.addEventListener('change', () => {
        if (tick.checked) settled.add(k);
        else settled.delete(k);
        editor.refresh();
      });
      const button = element('button', { type: 'button', dataset: { doubt: k } }, plain(words));
      button.addEventListener('click', () => editor.select(own));
      const here = own.length === selected.size && own.every((i) => selected.has(i));
      return element('li', { className: `${decided ? 'decided' : ''}${here ? ' picked' : ''}` }, tick, button);
    });
    const left = rows.filter((row) => !row.classList.contains('decided')).length;
    by('doubts-head').textContent = mine.length ? `Doubts: ${left} of ${mine.length} left` : `Doubts: none${this.#own().some((i) => assignment.now[i].segment) ? '' : ' yet'}`;
    by('doubts').replaceChildren(...rows);
  }

  #segments() {
    const { editor, about } = this;
    const { now } = editor.assignment;
    const own = this.#own();
    const groups = [
      [NOT_PLACED, own.filter((i) => !now[i].segment && !now[i].ignored)],
      ...about.segments.map(({ name }) => [name, editor.assignment.members(name, editor.subject)]),
      [IGNORED, own.filter((i) => now[i].ignored)],
    ];
    by('segments').replaceChildren(...groups.filter(([name, members]) => members.length || this.order.has(name)).map(([name, members], k) => {
      const rigid = this.order.has(name) && members.length > 1 ? millimetres(editor.rigidity.within(members)) : '';
      const rows = members.map((i) => {
        const { label, seen } = about.markers[i];
        const what = now[i].marker && now[i].marker !== label ? ` = ${plain(now[i].marker)}` : '';
        const button = element('button', {
          type: 'button', dataset: { marker: i }, className: `marker${editor.selected.has(i) ? ' picked' : ''}${seen ? '' : ' unseen'}`,
        }, `${plain(label)}${what}`);
        button.setAttribute('aria-pressed', editor.selected.has(i));
        button.addEventListener('click', (event) => editor.pick(i, event.shiftKey || event.ctrlKey || event.metaKey || by('several').checked));
        return button;
      });
      const head = element('summary', {}, swatch(this.order.get(name) ?? -1), plain(name), element('small', {}, `${members.length}${rigid ? ` · ${rigid}` : ''}`));
      const made = element('details', { open: members.length > 0 && !this.closed.has(name), dataset: { segment: name } }, head, element('p', { className: 'row' }, ...rows));
      made.addEventListener('toggle', () => {
        if (made.open) this.closed.delete(name);
        else if (members.length) this.closed.add(name);
      });
      return made;
    }));
  }

  #text() {
    if (by('text').open) by('written').value = this.editor.text();
  }
}
