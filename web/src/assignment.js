// Which marker each label is: what can be changed, undone, and written as an association file.

// A word of an association file that needs no quotes, as mocap_skel/labels/association.py reads it.
const PLAIN = /^[!$-?A-~][!$-~]*$/;
// What no line of a text file can hold, or what cannot be told apart there.
const UNWRITABLE = /["\p{Cc}\p{Cs}\u2028\u2029]/u;

export class Assignment {
  constructor(about) {
    this.about = about;
    this.now = about.markers.map(({ marker, segment, ignored }) => ({ marker, segment, ignored }));
    this.start = this.#copy();
    this.past = [];
    this.segmentOf = new Map(about.segments.flatMap(({ name, markers }) => markers.map((marker) => [marker, name])));
  }

  #copy() {
    return this.now.map((one) => ({ ...one }));
  }

  /** Whether a label can stand in a file. */
  writable(i) {
    const { label } = this.about.markers[i];
    return label !== '' && label === label.trim() && !UNWRITABLE.test(label);
  }

  changed(i) {
    const [a, b] = [this.now[i], this.start[i]];
    return a.marker !== b.marker || a.segment !== b.segment || a.ignored !== b.ignored;
  }

  /** The markers of a segment, of one subject. */
  members(segment, subject) {
    return this.#columns(subject).filter((i) => this.now[i].segment === segment);
  }

  #columns(subject) {
    return this.now.map((_, i) => i).filter((i) => this.about.markers[i].subject === subject);
  }

  /** Who of the same subject has a marker's name; -1 for nobody. */
  holder(marker, subject) {
    return this.now.findIndex((one, i) => one.marker === marker && this.about.markers[i].subject === subject);
  }

  /** The same labels of the other subjects, and these: a line of a file holds for all of them. */
  #alike(columns) {
    const labels = new Set(columns.map((i) => this.about.markers[i].label));
    return this.now.map((_, i) => i).filter((i) => labels.has(this.about.markers[i].label));
  }

  #change(columns, together, act) {
    const all = (together ? this.#alike(columns) : columns).filter((i) => this.writable(i));
    if (!all.length) return false;
    const before = this.#copy();
    all.forEach(act);
    if (JSON.stringify(before) === JSON.stringify(this.now)) return false;
    this.past.push(before);
    return true;
  }

  /** Gives markers to a segment, or to none (''); each keeps its name where that can be. */
  place(columns, segment, together) {
    return this.#change(columns, together, (i) => {
      const { marker } = this.now[i];
      const kept = marker && (this.segmentOf.get(marker) ?? segment) === segment ? marker : '';
      this.now[i] = { marker: '', segment: '', ignored: false };
      if (segment) this.now[i] = { marker: kept || this.#ownName(i, segment), segment, ignored: false };
    });
  }

  /** Its label where that is free: the standard name of the segment, or a name of its own. */
  #ownName(i, segment) {
    const { label, subject } = this.about.markers[i];
    const free = (name) => {
      const standard = this.segmentOf.get(name);
      return (standard === undefined || standard === segment) && this.holder(name, subject) < 0;
    };
    let name = label;
    while (!free(name)) name += '_own';
    return name;
  }

  ignore(columns, together) {
    return this.#change(columns, together, (i) => { this.now[i] = { marker: '', segment: '', ignored: true }; });
  }

  /**
   * Gives a marker its name, and with a standard name its segment. Who had that name takes what this one was.
   * Returns what is wrong, or ''.
   */
  name(column, marker, together) {
    const name = marker.trim();
    const standard = this.segmentOf.get(name);
    if (!name || UNWRITABLE.test(name)) return 'A name has at least one letter, and no quotes.';
    if (!standard && !this.now[column].segment) {
      return `${name} is no marker of the skeleton: choose the segment first, then a name of your own.`;
    }
    this.#change([column], together, (i) => {
      const had = this.now[i];
      const holder = this.holder(name, this.about.markers[i].subject);
      // A name that is taken brings its own segment with it.
      const segment = standard ?? (holder >= 0 ? this.now[holder].segment : had.segment);
      this.now[i] = { marker: name, segment, ignored: false };
      if (holder >= 0 && holder !== i) this.now[holder] = had;
    });
    return '';
  }

  /** Two markers of one subject take each other's place. */
  exchange(column, other, together) {
    const { label, subject } = this.about.markers[other];
    if (!this.writable(other) || subject !== this.about.markers[column].subject) return false;
    return this.#change([column], together, (i) => {
      const whose = this.about.markers[i].subject;
      const j = this.about.markers.findIndex((one) => one.label === label && one.subject === whose);
      if (j >= 0) [this.now[i], this.now[j]] = [this.now[j], this.now[i]];
    });
  }

  undo() {
    const before = this.past.pop();
    if (before) this.now = before;
    return Boolean(before);
  }

  /** Label → what it is, if all subjects agree on it and no two labels are one marker; else null. */
  #agreed() {
    const lines = new Map();
    for (const [i, { label }] of this.about.markers.entries()) {
      const other = lines.get(label);
      if (other !== undefined && JSON.stringify(this.now[other]) !== JSON.stringify(this.now[i])) return null;
      lines.set(label, i);
    }
    const names = [...lines.values()].map((i) => this.now[i].marker).filter(Boolean);
    return new Set(names).size === names.length ? [...lines.values()] : null;
  }

  /** Whether one file holds for all subjects. */
  get together() {
    return this.about.subjects.length < 2 || this.#agreed() !== null;
  }

  /** The association file: of all subjects where one can hold for all, else of this one, by its prefix. */
  text(subject) {
    const agreed = this.#agreed();
    const columns = (agreed ?? this.#columns(subject)).filter((i) => this.writable(i));
    const prefix = agreed || !subject ? '' : `${subject}:`;
    const label = (i) => this.about.markers[i].label;
    const parts = [this.#head(prefix, subject)];
    const used = { labels: new Set(columns.map(label)), names: new Set(columns.map((i) => this.now[i].marker)) };
    for (const { name, markers } of this.about.segments) {
      const rank = (i) => (markers.indexOf(this.now[i].marker) + markers.length + 1) % (markers.length + 1);
      const own = columns.filter((i) => this.now[i].segment === name).sort((a, b) => rank(a) - rank(b));
      const rows = own.map((i) => this.#row(prefix + label(i), this.now[i].marker, name));
      if (rows.length) parts.push(`# ${name}\n${aligned(rows)}`);
    }
    const absent = this.about.absent.filter(([absentLabel, marker]) => !used.labels.has(absentLabel) && !used.names.has(marker));
    if (absent.length) {
      parts.push(`# Labels that this clip does not have\n${aligned(absent.map((rule) => this.#row(...rule)))}`);
    }
    const { patterns } = this.about;
    const ignored = columns.filter((i) => this.now[i].ignored && !(patterns.length && this.start[i].ignored));
    const left = [...patterns, ...ignored.map((i) => label(i).replace(/[*?[]/g, '[$&]'))];
    if (left.length) parts.push(`# Left out on purpose\n${left.map((one) => `ignore  ${quoted(one)}`).join('\n')}\n`);
    const rest = columns.filter((i) => !this.now[i].segment && !this.now[i].ignored);
    if (rest.length) parts.push(`# Not placed\n${rest.map((i) => `# ${quoted(label(i))}`).join('\n')}\n`);
    return `${parts.join('\n')}`;
  }

  #head(prefix, subject) {
    const { clip, figure } = this.about;
    const whose = prefix ? ` of ${oneLine(subject)}` : '';
    return `# ${oneLine(clip)}${whose}: association made on the page of mocap-skel assoc page.\n`
      + '# LABEL  MARKER  [SEGMENT]\n'
      + (figure ? `@skeleton ${quoted(figure)}\n` : '');
  }

  #row(label, marker, segment) {
    // The word ignore with one other would drop labels.
    const whole = this.segmentOf.get(marker) !== segment || label === 'ignore';
    return [quoted(label), quoted(marker), whole ? quoted(segment) : ''];
  }
}

function quoted(name) {
  return PLAIN.test(name) ? name : `"${name}"`;
}

/** A text of a comment: on one line, whatever it holds. */
function oneLine(text) {
  return text.replace(/[\p{Cc}\p{Cf}\p{Cs}\p{Zl}\p{Zp}]+/gu, ' ');
}

function aligned(rows) {
  const widths = [0, 1].map((k) => Math.max(...rows.map((row) => row[k].length)));
  return rows.map((row) => `${row[0].padEnd(widths[0])}  ${row[1].padEnd(widths[1])}  ${row[2]}`.trimEnd()).join('\n') + '\n';
}
