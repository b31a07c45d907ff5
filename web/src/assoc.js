// The page of an association: pick markers in the picture or in the list, say what they are, save the file.
import { Assignment } from './assignment.js';
import { Cloud } from './cloud.js';
import { Panel, millimetres, plain } from './panel.js';
import { Playing, start } from './playing.js';
import { Rigidity } from './rigidity.js';
import { Stage } from './stage.js';

const by = (id) => document.getElementById(id);
const SWITCHES = { labels: 'n', lines: 'l', follow: 'f', several: 'b' };
// Pixels: how far from a marker a finger or a mouse may be, and how far one may move in a click.
const FINGER = 26;
const MOUSE = 14;
const CLICK = 5;

class Editor extends Playing {
  constructor(data, stage) {
    super(data, stage, SWITCHES);
    this.cloud = stage.figure;
    this.assignment = new Assignment(data.about);
    this.rigidity = new Rigidity(data);
    this.selected = new Set();
    this.settled = new Set();
    this.said = [];
    // The text of each subject's file at the start, and as it was saved.
    this.first = new Map(data.about.subjects.map(({ name }) => [name, this.assignment.text(name)]));
    this.saved = new Map();
    this.words = data.about.markers.map((marker) => {
      const word = document.createElement('span');
      word.textContent = plain(marker.label);
      by('names').append(word);
      return word;
    });
    this.panel = new Panel(this);
    this.#subjects();
    this.switched();
    this.#picking();
    by('undo').addEventListener('click', () => this.undo());
    by('save').addEventListener('click', () => this.save());
    addEventListener('beforeunload', (event) => {
      if (this.data.about.subjects.some(({ name }) => this.state(name) === 'changed, not saved')) event.preventDefault();
    });
    addEventListener('keydown', (event) => {
      const written = event.target.type === 'text' || event.target.tagName === 'TEXTAREA';
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== 'z' || written) return;
      event.preventDefault();
      this.undo();
    });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.refresh());
  }

  /** Whether a change holds for the same labels of other subjects too. */
  get together() {
    return by('together').checked;
  }

  #subjects() {
    const { subjects } = this.data.about;
    const choice = by('subject');
    choice.replaceChildren(...subjects.map(({ name }, i) => new Option(plain(name) || '(no name)', i)));
    by('whose').hidden = subjects.length < 2;
    by('together').checked = this.assignment.together;
    choice.addEventListener('change', () => this.choose(Number(choice.value)));
    this.choose(0);
  }

  /** Shows one subject alone. */
  choose(i) {
    const { about } = this.data;
    const { name, root, ends } = about.subjects[i];
    this.subject = name;
    by('subject').value = i;
    Object.assign(about, { root, ends });
    this.cloud.shown = (marker) => about.markers[marker].subject === name;
    this.stage.reframe();
    this.stage.followed = null;
    this.stage.look('start');
    this.select([]);
  }

  switched() {
    this.cloud.show.lines = by('lines').checked;
    super.switched();
  }

  #picking() {
    const canvas = this.stage.renderer.domElement;
    const box = by('box');
    let down = null;
    const place = (event) => {
      const { left, top } = canvas.getBoundingClientRect();
      return [event.clientX - left, event.clientY - top];
    };
    const corners = ([x, y]) => [Math.min(x, down.at[0]), Math.min(y, down.at[1]), Math.max(x, down.at[0]), Math.max(y, down.at[1])];
    // Before the camera's own: a box is drawn in its place.
    canvas.parentElement.addEventListener('pointerdown', (event) => {
      if (event.target !== canvas || event.button !== 0) return;
      const add = event.shiftKey || event.ctrlKey || event.metaKey || by('several').checked;
      const boxed = event.shiftKey || by('several').checked;
      down = { at: place(event), add, boxed, id: event.pointerId };
      this.stage.controls.enabled = !boxed;
      if (boxed) canvas.setPointerCapture(event.pointerId);
    }, { capture: true });
    canvas.addEventListener('pointermove', (event) => {
      if (!down?.boxed || event.pointerId !== down.id) return;
      const [left, top, right, bottom] = corners(place(event));
      box.hidden = Math.hypot(right - left, bottom - top) <= CLICK;
      Object.assign(box.style, { left: `${left}px`, top: `${top}px`, width: `${right - left}px`, height: `${bottom - top}px` });
    });
    const end = (event) => {
      if (!down || event.pointerId !== down.id) return;
      const at = place(event);
      const [left, top, right, bottom] = corners(at);
      const { add, boxed } = down;
      down = null;
      box.hidden = true;
      this.stage.controls.enabled = true;
      if (event.type === 'pointercancel') return;
      if (Math.hypot(right - left, bottom - top) <= CLICK) {
        const found = this.stage.nearest(...at, event.pointerType === 'touch' ? FINGER : MOUSE);
        if (found) this.pick(found.index, add);
        else if (!add) this.select([]);
      } else if (boxed) {
        const inside = this.cloud.markerPlaces.map((one) => this.stage.screen(one))
          .map((p, i) => (p && left <= p[0] && p[0] <= right && top <= p[1] && p[1] <= bottom ? i : -1)).filter((i) => i >= 0);
        this.select([...this.selected, ...inside]);
      }
    };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
  }

  /** Selects a marker alone, or adds it to the selection, or takes it out again. */
  pick(marker, add = false) {
    if (!add) this.select(this.selected.size === 1 && this.selected.has(marker) ? [] : [marker]);
    else this.select(this.selected.has(marker) ? [...this.selected].filter((i) => i !== marker) : [...this.selected, marker]);
  }

  select(markers) {
    this.selected = new Set(markers);
    this.said = [];
    this.refresh();
  }

  /** Makes a change, and says how the segments' rigidity changes by it. */
  change(act) {
    const segments = this.data.about.segments.map(({ name }) => name);
    const rigid = () => new Map(segments.map((name) => [name, this.rigidity.within(this.assignment.members(name, this.subject))]));
    const was = rigid();
    act();
    const is = rigid();
    this.said = segments.filter((name) => !Object.is(was.get(name), is.get(name)))
      .map((name) => `${name}: ${millimetres(was.get(name))} → ${millimetres(is.get(name))}`);
    this.refresh();
  }

  place(segment, markers = [...this.selected]) {
    this.change(() => this.assignment.place(markers, segment, this.together));
  }

  ignore() {
    this.change(() => this.assignment.ignore([...this.selected], this.together));
  }

  exchange() {
    const [one, other] = this.selected;
    this.change(() => this.assignment.exchange(one, other, this.together));
  }

  name(marker, name) {
    let wrong = '';
    this.change(() => { wrong = this.assignment.name(marker, name, this.together); });
    if (wrong) this.said = [wrong];
    this.refresh();
  }

  undo() {
    this.change(() => this.assignment.undo());
  }

  /** The association file as its text. */
  text() {
    return this.assignment.text(this.subject);
  }

  get fileName() {
    const safe = this.subject.replace(/[^\p{L}\p{N}_.+-]+/gu, '_').replace(/^[._]+|[._]+$/g, '') || 'subject';
    return this.assignment.together ? 'map.txt' : `map.${safe}.txt`;
  }

  save() {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([this.text()], { type: 'text/plain' }));
    link.download = this.fileName;
    link.click();
    // The download has to have begun.
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    const { subjects } = this.data.about;
    for (const { name } of this.assignment.together ? subjects : [{ name: this.subject }]) this.saved.set(name, this.assignment.text(name));
    this.refresh();
  }

  /** Whether a subject's file as it is now has been saved, and whether there is anything in it to lose. */
  state(subject) {
    const text = this.assignment.text(subject);
    if (this.saved.has(subject)) return this.saved.get(subject) === text ? 'saved' : 'changed, not saved';
    return this.assignment.past.length && this.first.get(subject) !== text ? 'changed, not saved' : '';
  }

  refresh() {
    const { segments, markers } = this.data.about;
    const order = new Map(segments.map(({ name }, i) => [name, i]));
    this.cloud.selected = this.selected;
    this.cloud.segments = this.assignment.now.map((one) => order.get(one.segment) ?? -1);
    this.cloud.ignored = this.assignment.now.map((one) => one.ignored);
    this.cloud.pairs = segments.flatMap(({ name }) => this.rigidity.lines(this.assignment.members(name, this.subject).filter((i) => markers[i].seen)));
    this.panel.show();
    this.stage.stale = true;
  }

  draw() {
    super.draw();
    this.words.forEach((word, i) => {
      const named = this.selected.has(i) || (by('labels').checked && this.cloud.shown(i));
      const at = named ? this.stage.screen(this.cloud.markerPlaces[i]) : null;
      word.hidden = !at;
      if (at) word.style.transform = `translate(${at[0] + 9}px, ${at[1] - 9}px)`;
    });
  }

  unpick() {
    this.select([]);
  }
}

export const association = () => start((data) => {
  // The whole of it, until a subject is chosen.
  Object.assign(data.about, data.about.subjects[0]);
  const editor = new Editor(data, new Stage(data, by('view'), Cloud));
  editor.play(!matchMedia('(prefers-reduced-motion: reduce)').matches);
  return editor;
});
