"use strict";
// The report page: data, clock, scene, plots, tables. No library, no network.

let data = null, motion = null, bins = 0, signals = new Map(), start = 0, end = 0, count = 1;
const $ = (id) => document.getElementById(id);

// --- data ------------------------------------------------------------------------------------------------------------

/** Numbers of 16 bits from their base64. */
function wordsOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Uint16Array(bytes.buffer);
}

/** The run in the data of a page: arrays as functions of the index, nan where a value is not finite. */
function runOf(content) {
  const words = wordsOf(content.store);
  const column = ([first, low, step]) => (first < 0 ? () => low
    : (k) => { const q = words[first + k]; return q === 65535 ? NaN : low + step * q; });
  const { motion: film, signals: kept } = content;
  return {
    data: content,
    motion: film && {
      ...film, time: column(film.time), frames: film.frames.map((axes) => axes.map(column)),
      bands: Object.fromEntries(Object.entries(film.bands).map(([name, band]) => [name, {
        ...band, x: column(band.x), y: column(band.y), bending: column(band.bending), axial: column(band.axial),
      }])),
    },
    bins: kept.bins,
    signals: new Map(kept.rows.map((row) => [row.name, { ...row, at: column(row.at), low: column(row.low), high: column(row.high) }])),
    start: kept.bins ? kept.start : 0, end: kept.bins ? kept.end : 0, count: film ? film.count : 1,
  };
}

let current = null, ghost = null;
/** Look at this run; what is drawn and read is its. */
function use(run) { ({ data, motion, bins, signals, start, end, count } = current = run); }
use(runOf(JSON.parse($("data").textContent)));

/** A signal at a time, between the edges of its bins. */
function valueAt(signal, time) {
  if (!bins) return NaN;
  const place = Math.min(Math.max((time - start) / (end - start) * bins, 0), bins);
  const k = Math.min(Math.floor(place), bins - 1), share = place - k;
  return signal.at(k) * (1 - share) + signal.at(k + 1) * share;
}

const PREFIX = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "\u00b5"], [1e-9, "n"]];
const PREFIXED = new Set(["N", "m", "s", "J", "W", "Pa", "V", "A", "N m", "m/s", "m/s^2"]);

/** Power of a thousand that suits a size, and its letter. */
function prefix(size, unit) {
  if (!PREFIXED.has(unit) || !(size > 0)) return [1, ""];
  return PREFIX.find(([power]) => size >= power) || PREFIX[PREFIX.length - 1];
}

function words4(value, digits = 4) {
  if (!Number.isFinite(value)) return "not finite";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
}

/** A value with its unit, to four digits of the largest such value, `size`. */
function withUnit(value, unit, size = Math.abs(value)) {
  const [power, letter] = prefix(size, unit), most = size / power;
  const plain = Number.isFinite(value) && most >= 1e-3 && most < 1e5;
  const text = plain ? (value / power).toFixed(Math.max(0, 3 - Math.floor(Math.log10(most)))) : words4(value / power);
  return `${text.replace(/^-(0(\.0*)?)$/, "$1").replace("-", "\u2212")}${unit && unit !== "1" ? ` ${letter}${unit.replace("^2", "\u00b2")}` : ""}`;
}

// --- clock -----------------------------------------------------------------------------------------------------------

const clock = { time: start, playing: false, speed: 1, last: 0 };
const listeners = [];

function pictureAt(time) {
  if (!motion || count < 2) return 0;
  const first = motion.time(0), last = motion.time(count - 1);
  return Math.min(Math.max(Math.round((time - first) / (last - first) * (count - 1)), 0), count - 1);
}

function seek(time) {
  clock.time = Math.min(Math.max(time, start), end);
  for (const listener of listeners) listener();
}

function step(pictures) {
  if (!motion || count < 2) return;
  pause();
  const k = Math.min(Math.max(pictureAt(clock.time) + pictures, 0), count - 1);
  seek(motion.time(k));
}

function play() {
  if (clock.time >= end) clock.time = start;
  clock.playing = true;
  clock.last = performance.now();
  showPlaying();
  requestAnimationFrame(tick);
}

function pause() { clock.playing = false; showPlaying(); }

const calm = matchMedia("(prefers-reduced-motion: reduce)");  // single pictures then, two a second
const STILL = 500;

function tick(now) {
  if (!clock.playing) return;
  if (calm.matches && now - clock.last < STILL) { requestAnimationFrame(tick); return; }
  const next = clock.time + Math.max(now - clock.last, 0) / 1000 * clock.speed;
  clock.last = now;
  if (next >= end && !clock.loop) { seek(end); pause(); return; }
  seek(next < end ? next : start);
  requestAnimationFrame(tick);
}

function showPlaying() {
  $("play").innerHTML = clock.playing ? "&#10074;&#10074;" : "&#9654;";
  $("play").setAttribute("aria-label", clock.playing ? "Pause" : "Play");
}

// --- scene -----------------------------------------------------------------------------------------------------------

const scene = $("scene"), view = { zoom: 1, x: 0, y: 0 };
const shown = { names: true, forces: true, colour: "bending", trail: "", length: 0 };

function sized(canvas) {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, box.width, box.height);
  return [pen, box.width, box.height];
}

/** The box of what is seen: of the run, and of its ghost. */
function boxOf() {
  if (!ghost || !ghost.motion) return motion.box;
  return motion.box.map((value, k) => (k % 2 ? Math.max : Math.min)(value, ghost.motion.box[k]));
}

/** From metres to pixels, for the present view. */
function mapping(width, height) {
  const [left, right, low, high] = boxOf(), room = 5 * motion.unit;
  const scale = Math.min(width / (right - left + 2 * room), height / (high - low + 2 * room)) * view.zoom;
  const x0 = width / 2 - scale * ((left + right) / 2) + view.x, y0 = height / 2 + scale * ((low + high) / 2) + view.y;
  return { scale, at: (x, y) => [x0 + scale * x, y0 - scale * y] };
}

/** Places of a frame's points in picture k. */
function place(frame, k, points) {
  const [fx, fy, turn] = motion.frames[frame], x = fx(k), y = fy(k), angle = turn(k), c = Math.cos(angle), s = Math.sin(angle);
  return points.map(([a, b]) => [x + c * a - s * b, y + s * a + c * b]);
}

function trace(pen, points, map) {
  pen.beginPath();
  points.forEach(([x, y], k) => { const at = map.at(x, y); if (k) pen.lineTo(...at); else pen.moveTo(...at); });
}

const draw = {
  Outline(pen, map, k, [, frame, ink, points, closed]) {
    trace(pen, place(frame, k, points), map);
    if (closed) pen.closePath();
    paint(pen, ink, closed);
  },
  Disc(pen, map, k, [, frame, ink, centre, radius]) {
    pen.beginPath();
    pen.arc(...map.at(...place(frame, k, [centre])[0]), radius * map.scale, 0, 2 * Math.PI);
    paint(pen, ink, true);
  },
  Span(pen, map, k, [, frame, other, ink, points]) {
    const [a] = place(frame, k, [[0, 0]]), [b] = place(other, k, [[0, 0]]);
    const dx = b[0] - a[0], dy = b[1] - a[1], size = Math.hypot(dx, dy) || 1;
    trace(pen, points.map(([s, n]) => [a[0] + s * dx - n * dy / size, a[1] + s * dy + n * dx / size]), map);
    paint(pen, ink, false);
  },
  StripMark(pen, map, k, [, link, ink]) {
    const band = motion.bands[link], n = band.stations, width = Math.max(3, band.thickness * map.scale);
    const points = Array.from({ length: n }, (_, i) => [band.x(k * n + i), band.y(k * n + i)]);
    pen.lineCap = pen.lineJoin = "round";
    trace(pen, points, map);
    pen.lineWidth = width + 2; pen.strokeStyle = data.inks[ink].line; pen.stroke();
    if (shown.colour === "plain") { pen.lineWidth = width; pen.strokeStyle = data.inks[ink].fill; pen.stroke(); return; }
    pen.lineWidth = width; pen.lineCap = "butt";
    for (let i = 0; i + 1 < n; i++) {
      pen.strokeStyle = tint((strength(band, k * n + i) + strength(band, k * n + i + 1)) / 2 / largest());
      trace(pen, [points[i], points[i + 1]], map); pen.stroke();
    }
  },
  Arrow(pen, map, k, [, frame, ink, names, along, within]) {
    if (!shown.forces) return;
    const [fx, fy] = forceAt(names, along, within, motion.time(k), k), size = Math.hypot(fx, fy);
    if (!(size > 1e-3 * scaleOfForces().size)) return;
    const [tail] = place(frame, k, [[0, 0]]), extent = spread();
    const length = Math.min(size / scaleOfForces().size * 0.16 * 2 ** shown.length, 0.5) * extent;
    arrow(pen, map, tail, [fx / size, fy / size], length, data.inks[ink].line);
  },
  Label(pen, map, k, [, frame, text, at, what]) {
    if (!shown.names && what !== "symbol") return;
    const [x, y] = map.at(...place(frame, k, [at])[0]);
    pen.font = what === "link" ? "12px system-ui, sans-serif" : "600 13px system-ui, sans-serif";
    pen.textAlign = "center"; pen.textBaseline = "middle";
    pen.lineWidth = 4; pen.strokeStyle = "rgba(255,255,255,.85)"; pen.lineJoin = "round"; pen.strokeText(text, x, y);
    pen.fillStyle = what === "link" ? "#4b5560" : "#1b2733"; pen.fillText(text, x, y);
  },
};

function paint(pen, ink, filled) {
  const { line, fill, width } = data.inks[ink];
  if (filled && fill) { pen.fillStyle = fill; pen.fill(); }
  pen.lineWidth = 1.2 * width; pen.strokeStyle = line; pen.lineJoin = pen.lineCap = "round"; pen.stroke();
}

function arrow(pen, map, [x, y], [dx, dy], length, colour) {
  const head = Math.min(9, 0.5 * length * map.scale), [x0, y0] = map.at(x, y), [x1, y1] = map.at(x + length * dx, y + length * dy);
  pen.strokeStyle = pen.fillStyle = colour; pen.lineWidth = 2; pen.lineCap = "butt";
  pen.beginPath(); pen.moveTo(x0, y0); pen.lineTo(x1 - head * dx, y1 + head * dy); pen.stroke();
  pen.beginPath(); pen.moveTo(x1, y1);
  pen.lineTo(x1 - head * dx - 0.45 * head * dy, y1 + head * dy - 0.45 * head * dx);
  pen.lineTo(x1 - head * dx + 0.45 * head * dy, y1 + head * dy + 0.45 * head * dx);
  pen.fill();
}

function spread() { const [left, right, low, high] = motion.box; return Math.max(right - left, high - low, 1e-12); }

function forceAt(names, along, within, time, k) {
  const values = names.map((name) => valueAt(signals.get(name), time));
  if (values.length === 2) return values;
  const turn = motion.frames[within][2](k), c = Math.cos(turn), s = Math.sin(turn);
  return [values[0] * (c * along[0] - s * along[1]), values[0] * (s * along[0] + c * along[1])];
}

/** A round force that an arrow of fixed length stands for: below nine tenths of all forces of the run. */
const scaleOfForces = once(() => current, () => {
  const sizes = [];
  for (const [kind, , , names] of motion.marks) {
    if (kind !== "Arrow") continue;
    const columns = names.map((name) => signals.get(name));
    for (let k = 0; k <= bins; k += Math.max(1, Math.floor(bins / 100))) {
      const size = Math.hypot(...columns.map((signal) => signal.at(k)));
      if (size > 0) sizes.push(size);
    }
  }
  sizes.sort((a, b) => a - b);
  return { size: sizes.length ? round(sizes[Math.floor(0.9 * (sizes.length - 1))]) : 0 };
});

function once(key, make) { const made = new WeakMap(); return () => { if (!made.has(key())) made.set(key(), make()); return made.get(key()); }; }

function round(size) {
  if (!(size > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(size)), lead = size / power;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}

// --- colours of strips -----------------------------------------------------------------------------------------------

const RAMPS = {
  bending: [[-1, 33, 90, 170], [-0.5, 120, 170, 220], [0, 222, 226, 230], [0.5, 240, 160, 110], [1, 178, 24, 43]],
  stress: [[0, 222, 226, 230], [0.35, 244, 200, 90], [0.7, 226, 104, 47], [1, 130, 14, 40]],
};

function strength(band, at) {
  const bending = band.bending(at);
  if (shown.colour === "bending") return bending;
  return band.modulus * (Math.abs(bending) * band.thickness / 2 + Math.abs(band.axial(at)));
}

function largest() {
  const largestOf = (current.largest ??= {});
  if (largestOf[shown.colour] === undefined) {
    let most = 0;
    for (const band of Object.values(motion.bands)) {
      for (let at = 0; at < count * band.stations; at++) {
        const value = Math.abs(strength(band, at));
        if (value > most) most = value;
      }
    }
    largestOf[shown.colour] = most || 1;
  }
  return largestOf[shown.colour];
}

function tint(part) {
  const ramp = RAMPS[shown.colour];
  let k = 1;
  while (k < ramp.length - 1 && part > ramp[k][0]) k++;
  const [a, b] = [ramp[k - 1], ramp[k]], share = Math.min(Math.max((part - a[0]) / (b[0] - a[0]), 0), 1);
  return `rgb(${[1, 2, 3].map((i) => Math.round(a[i] + share * (b[i] - a[i]))).join(",")})`;
}

function drawLegend() {
  const [pen, width] = sized($("legend"));
  if (!motion) return;
  pen.font = "11px system-ui, sans-serif"; pen.fillStyle = "#37424d"; pen.textBaseline = "alphabetic";
  const most = shown.colour !== "plain" && hasBands() ? largest() : 0;
  if (most) {
    const span = 150, low = shown.colour === "bending" ? -1 : 0;
    for (let i = 0; i < span; i++) { pen.fillStyle = tint(low + (1 - low) * i / (span - 1)); pen.fillRect(i, 14, 1.5, 9); }
    pen.fillStyle = "#37424d";
    const unit = shown.colour === "bending" ? "1/m" : "Pa";
    pen.textAlign = "left";
    pen.fillText(shown.colour === "bending" ? "change of curvature" : "largest stress", 0, 10);
    const [power, letter] = prefix(most, unit), limit = words4(most / power, 2);
    pen.fillText(low ? `\u2212${limit}` : "0", 0, 36);
    pen.textAlign = "right"; pen.fillText(`${limit} ${letter}${unit}`, span, 36);
  }
  const { size } = hasForces() && shown.forces ? scaleOfForces() : { size: 0 };
  if (size > 0) {
    const map = mapping(scene.clientWidth, scene.clientHeight), length = 0.16 * 2 ** shown.length * spread() * map.scale;
    const x = most ? 175 : 0;
    pen.textAlign = "left"; pen.fillText(`${words4(size / prefix(size, "N")[0])} ${prefix(size, "N")[1]}N`, x, 36);
    arrow(pen, { scale: 1, at: (a, b) => [x + a, 20 - b] }, [0, 0], [1, 0], Math.min(length, width - x), data.inks.force.line);
  }
}

const hasBands = () => Object.keys(motion.bands).length > 0;
const hasForces = () => motion.marks.some(([kind]) => kind === "Arrow");

function drawScene() {
  const [pen, width, height] = sized(scene);
  if (!motion) {
    pen.font = "14px system-ui, sans-serif"; pen.textAlign = "center"; pen.fillStyle = "#55616d";
    pen.fillText("This result holds no motion.", width / 2, height / 2);
    return;
  }
  const map = mapping(width, height), k = pictureAt(clock.time);
  if (ghost && ghost.motion) drawGhost(pen, map);
  drawTrail(pen, map, k);
  for (const mark of motion.marks) draw[mark[0]](pen, map, k, mark);
}

/** The run before the last change, pale and without words and forces. */
function drawGhost(pen, map) {
  const run = current;
  use(ghost);
  pen.save();
  pen.globalAlpha = 0.28; pen.filter = "grayscale(1)";
  const k = pictureAt(clock.time);
  for (const mark of motion.marks) if (mark[0] !== "Arrow" && mark[0] !== "Label") draw[mark[0]](pen, map, k, mark);
  pen.restore();
  use(run);
}

function drawTrail(pen, map, k) {
  const frame = motion.names.indexOf(shown.trail);
  if (frame < 0) return;
  const [x, y] = motion.frames[frame];
  for (const [from, to, colour, width] of [[0, count - 1, "rgba(27,95,170,.25)", 1.5], [0, k, "rgba(27,95,170,.9)", 2]]) {
    trace(pen, Array.from({ length: to - from + 1 }, (_, i) => [x(from + i), y(from + i)]), map);
    pen.lineWidth = width; pen.strokeStyle = colour; pen.lineJoin = "round"; pen.stroke();
  }
}

// --- plots -----------------------------------------------------------------------------------------------------------

const EDGE = { left: 52, right: 8, top: 6, bottom: 20 };

/** Round marks of an axis. */
function ticks(low, high, wanted) {
  const rough = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((lead) => lead * power).find((size) => size >= rough * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

const plotUnit = ({ unit, limits }) => [prefix(Math.max(...limits.map(Math.abs)), unit)[1], unit];
const axisUnit = ([letter, unit]) => (unit && unit !== "1" ? ` [${letter}${unit.replace("^2", "\u00b2")}]` : "");

class Plot {
  /** Curves on one pair of axes with the page's cursor. */
  constructor(host, curves, label) {
    this.curves = curves;
    this.canvas = host.appendChild(document.createElement("canvas"));
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    this.unit = curves[0].signal.unit;
    this.before = ghost ? curves.map(({ signal }) => ghost.signals.get(signal.name)).filter(Boolean) : [];
    const limits = [...curves.map(({ signal }) => signal), ...this.before].map((signal) => signal.limits);
    let low = Math.min(...limits.map(([a]) => a)), high = Math.max(...limits.map(([, b]) => b));
    if (!(high > low)) { const room = Math.abs(low) || 1; low -= 0.5 * room; high += 0.5 * room; }
    this.low = low - 0.06 * (high - low); this.high = high + 0.06 * (high - low);
    [this.power, this.letter] = prefix(Math.max(Math.abs(low), Math.abs(high)), this.unit);
    const follow = (event) => { if (event.buttons) { pause(); seek(this.timeAt(event)); } };
    this.canvas.addEventListener("pointerdown", (event) => { this.canvas.setPointerCapture(event.pointerId); follow(event); });
    this.canvas.addEventListener("pointermove", follow);
  }

  timeAt(event) {
    const box = this.canvas.getBoundingClientRect();
    return start + (event.clientX - box.left - EDGE.left) / (box.width - EDGE.left - EDGE.right) * (end - start);
  }

  render() {
    const [pen, width, height] = sized(this.canvas), { left, right, top, bottom } = EDGE;
    const x = (t) => left + (t - start) / (end - start) * (width - left - right);
    const y = (v) => top + (this.high - v) / (this.high - this.low) * (height - top - bottom);
    pen.font = "11px system-ui, sans-serif"; pen.fillStyle = "#55616d"; pen.lineWidth = 1; pen.strokeStyle = "#e3e8ed";
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const tick of ticks(this.low / this.power, this.high / this.power, 4)) {
      const at = Math.round(y(tick * this.power)) + 0.5;
      line(pen, left, at, width - right, at); pen.fillText(words4(tick).replace("-", "\u2212"), left - 6, at);
    }
    pen.textAlign = "center"; pen.textBaseline = "alphabetic";
    for (const tick of ticks(start, end, Math.max(2, width / 110))) {
      const at = Math.round(x(tick)) + 0.5;
      line(pen, at, top, at, height - bottom); pen.fillText(`${words4(tick)} s`, Math.min(at, width - 16), height - 6);
    }
    if (this.before.length) this.pale(pen, x, y);
    for (const { signal, colour, dash } of this.curves) this.curve(pen, signal, colour, dash, x, y);
    const at = x(clock.time);
    pen.setLineDash([]); pen.strokeStyle = "#1b2733"; pen.lineWidth = 1.5; line(pen, at, top, at, height - bottom);
    for (const { signal, colour } of this.curves) {
      const value = valueAt(signal, clock.time);
      if (!Number.isFinite(value)) continue;
      pen.beginPath(); pen.arc(at, y(value), 3.5, 0, 2 * Math.PI); pen.fillStyle = colour; pen.fill();
      pen.lineWidth = 1.5; pen.strokeStyle = "#fff"; pen.stroke();
    }
  }

  pale(pen, x, y) {
    const run = current;
    use(ghost);
    for (const signal of this.before) this.curve(pen, signal, "#8a949e", [5, 3], x, y);
    use(run);
  }

  curve(pen, signal, colour, dash, x, y) {
    const edge = (k) => x(start + (end - start) * k / bins);
    pen.setLineDash([]); pen.lineWidth = 1; pen.strokeStyle = pen.fillStyle = colour; pen.globalAlpha = 0.45;
    for (let k = 0; k < bins; k++) { // what a bin hides: its least and largest value
      const low = y(signal.low(k)), high = y(signal.high(k));
      if (low - high > 1) pen.fillRect(edge(k), high, Math.max(edge(k + 1) - edge(k), 1), low - high);
    }
    pen.globalAlpha = 1; pen.lineWidth = 1.6; pen.lineJoin = "round"; pen.setLineDash(dash || []);
    pen.beginPath();
    let open = false;
    for (let k = 0; k <= bins; k++) {
      const value = signal.at(k);
      if (!Number.isFinite(value)) { open = false; continue; }
      if (open) pen.lineTo(edge(k), y(value)); else pen.moveTo(edge(k), y(value));
      open = true;
    }
    pen.stroke(); pen.setLineDash([]);
  }
}

function line(pen, x0, y0, x1, y1) { pen.beginPath(); pen.moveTo(x0, y0); pen.lineTo(x1, y1); pen.stroke(); }

const CURVES = ["#0072B2", "#D55E00", "#009E73", "#A8508A", "#8A6D00", "#2B7DA8", "#1b2733"];
let plots = [];
const chosen = new Set(bins ? data.signals.first : []);

function element(name, text = "", parent = null) {
  const made = document.createElement(name);
  made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

/** A name that breaks behind its dots where it does not fit. */
function wrapped(host, text) {
  text.split(/(?<=[.(])/).forEach((part, k) => host.append(...(k ? [document.createElement("wbr"), part] : [part])));
  return host;
}

function makePlots() {
  for (const name of chosen) if (!signals.has(name)) chosen.delete(name);
  $("plots").replaceChildren();
  plots = [...chosen].map((name, k) => {
    const signal = signals.get(name), host = element("div", "", $("plots"));
    host.className = "plot";
    const head = element("header", "", host);
    wrapped(element("b", "", head), name + axisUnit(plotUnit(signal)));
    const right = element("span", "", head), now = element("output", "", right), size = Math.max(...signal.limits.map(Math.abs));
    const limits = signal.limits.map((value) => withUnit(value, signal.unit, size));
    element("span", `   from ${limits[0]} to ${limits[1]}`, right);
    const label = `${name} over time, from ${limits[0]} to ${limits[1]}`;
    const plot = new Plot(host, [{ signal, colour: CURVES[k % CURVES.length] }], label);
    return { name, plot, update() { now.textContent = withUnit(valueAt(signal, clock.time), signal.unit, size); plot.render(); } };
  });
  if (!plots.length) element("p", bins ? "No signal is chosen." : "The run left no signals.", $("plots")).className = "none";
  $("chosen").textContent = `${chosen.size} of ${signals.size}`;
  plots.forEach((plot) => plot.update());
}

function makeList() {
  $("list").replaceChildren();
  for (const { name, unit } of signals.values()) {
    const label = element("label", "", $("list")), box = element("input", "", label);
    box.type = "checkbox"; box.checked = chosen.has(name);
    box.addEventListener("change", () => { if (box.checked) chosen.add(name); else chosen.delete(name); makePlots(); });
    wrapped(label, ` ${name}${unit && unit !== "1" ? ` (${unit})` : ""}`);
    label.dataset.name = name.toLowerCase();
  }
  filterList();
}

function filterList() {
  const part = $("filter").value.trim().toLowerCase();
  for (const label of $("list").children) label.hidden = !label.dataset.name.includes(part);
}

// --- verdict, checks, energy, facts ----------------------------------------------------------------------------------

const SHAPES = { // told apart by shape as well as by colour
  good: '<circle cx="12" cy="12" r="11" fill="currentColor"/><path d="M6.5 12.5l3.7 3.8 7.3-8" fill="none" stroke="#fff" stroke-width="2.6"/>',
  doubt: '<path d="M12 1.5L23.3 22H.7z" fill="currentColor"/><path d="M12 8.5v7" stroke="#fff" stroke-width="2.6"/><circle cx="12" cy="18.7" r="1.5" fill="#fff"/>',
  bad: '<path d="M7.4 1h9.2L23 7.4v9.2L16.6 23H7.4L1 16.6V7.4z" fill="currentColor"/><path d="M7.8 7.8l8.4 8.4M16.2 7.8l-8.4 8.4" stroke="#fff" stroke-width="2.6"/>',
  none: '<path d="M3 12h18" stroke="currentColor" stroke-width="2.6"/>',
};
const icon = (kind) => `<svg viewBox="0 0 24 24" aria-hidden="true" class="${kind}">${SHAPES[kind]}</svg>`;

function showVerdict() {
  const kind = data.ok ? "good" : data.finished ? "doubt" : "bad";
  $("badge").className = kind;
  $("badge").innerHTML = icon(kind);
  element("span", data.status, $("badge"));
  $("title").textContent = data.title;
  $("summary").textContent = data.summary;
  const said = [...(data.ok && data.message ? [data.message] : []), ...data.notes];
  $("said").replaceChildren(...said.map((text) => element("li", text)));
  $("said").hidden = !said.length;
  $("alert").hidden = data.ok;
  $("alert").replaceChildren();
  if (data.ok) return;
  $("alert").className = kind;
  const judged = data.status === "SUSPECT" ? "The run finished, but its checks failed. Do not trust its numbers."
    : data.finished ? "The run finished, but its numbers hold in part only." : "The run did not reach its end.";
  element("strong", judged, $("alert"));
  const failed = data.checks.filter((row) => row.verdict === "failed");
  const list = element("ul", "", $("alert"));
  for (const text of failed.length ? failed.map((row) => (row.name === "OTHER" ? row.message : `${row.name}: ${row.message}`)) : [data.message]) element("li", text, list);
}

/** Each measure with its error beside it, amber where that is above the accuracy asked for. */
function showMeasures() {
  const body = document.querySelector("#measures tbody");
  $("measures").hidden = !data.readings.length;
  body.replaceChildren();
  for (const { name, value, unit, error, relative, beyond } of data.readings) {
    const row = element("tr", "", body);
    wrapped(element("td", "", row), name);
    element("td", value === null ? "no value" : withUnit(value, unit), row);
    const cell = element("td", "", row);
    if (beyond) { row.className = "beyond"; cell.innerHTML = icon("doubt"); }
    const share = relative === null ? "" : ` (${relative < 1e-3 ? relative.toExponential(1) : `${Number((100 * relative).toPrecision(2))}\u00a0%`})`;
    cell.append(error === null ? "not known" : `\u00b1 ${short(error, unit)}${share}`);
  }
  const beyond = data.readings.some((row) => row.beyond);
  $("measures-note").textContent = beyond ? "Marked: the relative error is above the accuracy asked for, 5 % if none was, or is not known." : "";
  showAllMeasures($("measures").classList.contains("all"));
}

/** The button that shows measures beyond the first five; those with too large an error are always there. */
function showAllMeasures(all) {
  const hidden = data.readings.filter((row, k) => k >= 5 && !row.beyond).length, button = $("measures-all");
  $("measures").classList.toggle("all", all);
  button.setAttribute("aria-expanded", all);
  button.hidden = !hidden;
  button.textContent = all ? "Show fewer" : `Show ${hidden} more`;
  button.onclick = () => showAllMeasures(!all);
}

/** An error with its unit, to two digits. */
function short(value, unit) {
  const [power, letter] = prefix(value, unit);
  return `${words4(value / power, 2)}${unit && unit !== "1" ? `\u00a0${letter}${unit.replace("^2", "\u00b2")}` : ""}`;
}

function showChecks() {
  for (const body of document.querySelectorAll("#checks tbody")) body.replaceChildren();
  const idle = data.checks.filter((row) => row.verdict === "not applicable").length;
  $("idle").hidden = !idle;
  $("idle-count").textContent = `${idle} with nothing to look at`;
  for (const { name, question, verdict, message } of data.checks) {
    const row = element("tr", "", document.querySelector(verdict === "not applicable" ? "#idle tbody" : "#checks tbody"));
    row.className = verdict.replace(" ", "-");
    element("td", name, row);
    element("td", question, row);
    const cell = element("td", "", row);
    cell.innerHTML = icon({ failed: data.finished ? "doubt" : "bad", "no complaint": "good" }[verdict] || "none");
    cell.append(message ? `${verdict}: ${message}` : verdict);
  }
}

let energy = null;
function showEnergy() {
  energy = null;
  $("energy-plot").replaceChildren();
  const rows = [...signals.values()].filter(({ name }) => name.startsWith("energy ") && !name.includes(".")
    && name !== "energy throughput").filter(({ name, limits }) => name === "energy error" || limits[0] !== limits[1]);
  if (!rows.length) {
    element("p", "The energy ledger was not asked for: simulate(..., ledger=True).", $("energy-plot")).className = "none";
    return;
  }
  const curves = rows.map((signal, k) => ({
    signal,
    colour: signal.name === "energy error" ? data.inks.force.line : CURVES[k % CURVES.length],
    dash: signal.name.includes("taken") ? [6, 4] : signal.name.includes("given") ? [2, 3] : [],
  }));
  const host = element("div", "", $("energy-plot")), plot = new Plot(host, curves, "Energies over time");
  host.className = "plot";
  const list = element("ul", "", $("energy-plot"));
  const items = curves.map(({ signal, colour, dash }) => {
    const item = element("li", "", list);
    item.innerHTML = `<svg width="26" height="8" aria-hidden="true"><path d="M0 4h26" stroke="${colour}" stroke-width="2.5" stroke-dasharray="${dash}"/></svg> `;
    element("span", signal.name.slice(7).replace("taken_", "taken by ").replace("given_", "given by ")
      .replace(/^error$/, "error of the balance") + " ", item);
    return [element("output", "", item), signal];
  });
  $("energy-heading").textContent = `Energy [${plot.letter}J]`;
  energy = () => {
    for (const [output, signal] of items) output.textContent = withUnit(valueAt(signal, clock.time), "J", plot.high);
    plot.render();
  };
}

function showFacts() {
  $("facts-tables")?.remove();
  const host = element("div", "", $("facts"));
  host.id = "facts-tables";
  for (const [heading, rows] of data.facts) {
    if (!rows.length) continue;
    const part = element("div", "", host), table = document.createElement("table");
    element("h3", heading, part);
    for (const [name, value] of rows) { const row = element("tr", "", table); element("td", name, row); element("td", value, row); }
    part.append(table);
  }
}

// --- controls --------------------------------------------------------------------------------------------------------

function zoom(factor, x = scene.clientWidth / 2, y = scene.clientHeight / 2) {
  const next = Math.min(Math.max(view.zoom * factor, 0.2), 2000), real = next / view.zoom;
  const cx = scene.clientWidth / 2, cy = scene.clientHeight / 2;
  view.x = (x - cx) * (1 - real) + view.x * real; view.y = (y - cy) * (1 - real) + view.y * real; view.zoom = next;
  drawScene(); drawLegend();
}

const actions = {
  play: () => (clock.playing ? pause() : play()),
  "zoom-in": () => zoom(1.4),
  "zoom-out": () => zoom(1 / 1.4),
  fit: () => { Object.assign(view, { zoom: 1, x: 0, y: 0 }); drawScene(); drawLegend(); },
};

const keys = {
  " ": actions.play, "+": actions["zoom-in"], "=": actions["zoom-in"], "-": actions["zoom-out"], 0: actions.fit,
  ArrowRight: (event) => step(event.shiftKey ? 10 : 1), ArrowLeft: (event) => step(event.shiftKey ? -10 : -1),
  Home: () => { pause(); seek(start); }, End: () => { pause(); seek(end); },
  f: () => $("forces").click(), n: () => $("names").click(),
};

function makeControls() {
  document.querySelectorAll("button[data-do]").forEach((button) => button.addEventListener("click", actions[button.dataset.do]));
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select, textarea, summary, input[type=search], input[type=number]")) return;
    if (event.key === " " && event.target.closest("button, input:not([type=range])")) return;
    if (/^Arrow|^Home$|^End$/.test(event.key) && event.target.closest("input[type=range]:not(#scrub), input[type=number]")) return;
    const action = keys[event.key];
    if (action) { event.preventDefault(); action(event); }
  });
  $("scrub").addEventListener("input", () => { pause(); if (motion) seek(motion.time(Number($("scrub").value))); });
  for (const name of ["names", "forces"]) {
    $(name).addEventListener("change", () => { shown[name] = $(name).checked; drawScene(); drawLegend(); });
  }
  $("colour").addEventListener("change", () => { shown.colour = $("colour").value; drawScene(); drawLegend(); });
  $("trail").addEventListener("change", () => { shown.trail = $("trail").value; drawScene(); });
  $("length").addEventListener("input", () => { shown.length = Number($("length").value); drawScene(); drawLegend(); });
  $("speed").addEventListener("change", () => { clock.speed = Number($("speed").value); });
  $("filter").addEventListener("input", filterList);
  makeDragging();
}

/** Choices of the controls that depend on the run. */
function showControls() {
  $("scrub").max = count - 1;
  $("trail").replaceChildren();
  for (const name of ["", ...(motion ? motion.points : [])]) element("option", name || "none", $("trail")).value = name;
  $("trail").value = shown.trail;
  $("colour-label").hidden = !motion || !hasBands();
  $("length-label").hidden = !motion || !hasForces();
  makeSpeeds();
}

/** Speeds about the one that shows the run in eight seconds, and real time. */
function makeSpeeds() {
  if ($("speed").options.length || !bins) return;
  const usual = round((end - start) / 8) || 1;
  const speeds = [...new Set([0.02, 0.1, 0.5, 1, 2, 10].map((factor) => Number((usual * factor).toPrecision(2))).concat(1))];
  for (const speed of speeds.sort((a, b) => a - b)) {
    const option = element("option", speed === 1 ? "real time" : speed < 1e-3 ? `real time / ${words4(Math.round(1 / speed))}` : `${words4(speed)} \u00d7 real time`, $("speed"));
    option.value = speed; option.selected = speed === usual;
  }
  clock.speed = usual;
}

function makeDragging() {
  scene.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = scene.getBoundingClientRect();
    zoom(Math.exp(-0.0015 * event.deltaY), event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  scene.addEventListener("pointerdown", (event) => scene.setPointerCapture(event.pointerId));
  scene.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    view.x += event.movementX; view.y += event.movementY; drawScene();
  });
}

function update() {
  const k = pictureAt(clock.time);
  $("scrub").value = k;
  $("scrub").setAttribute("aria-valuetext", `${words4(clock.time)} s`);
  $("clock").textContent = `${words4(clock.time)} s of ${words4(end)} s`;
  scene.setAttribute("aria-label", `The mechanism at ${words4(clock.time)} s`);
  drawScene();
  plots.forEach((plot) => plot.update());
  if (energy) energy();
}

/** All of the page that depends on the run. */
function showRun() { showVerdict(); showMeasures(); showChecks(); showEnergy(); showFacts(); makeList(); showControls(); makePlots(); }

makeControls(); showRun();
listeners.push(update);
const asked = Number(new URLSearchParams(location.hash.slice(1)).get("t")); // report.html#t=1.7 opens there
seek(asked || (data.finished ? start : end)); // a run that failed, where it ended
drawLegend();
window.addEventListener("resize", () => { update(); drawLegend(); });

/** For tests, and for a look from the console. */
window.report = {
  seek, step, play, pause, valueAt: (name) => valueAt(signals.get(name), clock.time),
  state: () => ({ time: clock.time, playing: clock.playing, picture: pictureAt(clock.time), zoom: view.zoom, chosen: [...chosen] }),
  frame: (name) => { const k = pictureAt(clock.time); return motion.frames[motion.names.indexOf(name)].map((axis) => axis(k)); },
};
