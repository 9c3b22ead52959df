"use strict";
// The page of a sweep: table, map, one case. No library, no network.

const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const { rows, parameters, metrics } = data;
const SHAPES = {
  good: '<circle cx="12" cy="12" r="10" fill="none" stroke="currentColor" stroke-width="2.5"/><path d="M7 12.5l3.5 3.5 6.5-8" fill="none" stroke="currentColor" stroke-width="2.5"/>',
  doubt: '<path d="M12 2.5L22.5 21H1.5z" fill="none" stroke="currentColor" stroke-width="2.5"/><path d="M12 9v6m0 2v1.6" stroke="currentColor" stroke-width="2.5"/>',
  bad: '<rect x="2.5" y="2.5" width="19" height="19" fill="none" stroke="currentColor" stroke-width="2.5"/><path d="M7.5 7.5l9 9m0-9l-9 9" stroke="currentColor" stroke-width="2.5"/>',
};
const kind = (status) => status === "OK" ? "good" : /(^|\d )SUSPECT$/.test(status) ? "doubt" : "bad";
const shape = (status) => `<svg class="mark ${kind(status)}" viewBox="0 0 24 24" aria-hidden="true">${SHAPES[kind(status)]}</svg>`;
const escape = (text) => String(text).replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" }[c]));
const digits = (value, count = 6) => value === null || value === undefined ? "" : typeof value !== "number" ? String(value)
  : value === 0 ? "0" : Math.abs(value) >= 1e6 || Math.abs(value) < 1e-4 ? value.toExponential(count - 2).replace(/\.?0+e/, "e")
  : String(Number(value.toPrecision(count)));
const titled = ({ name, unit }) => unit && unit !== "1" ? `${name} [${unit}]` : name;

// --- head ------------------------------------------------------------------------------------------------------------

$("title").textContent = data.title;
$("summary").textContent = data.summary;
$("badge").className = kind(data.status);
$("badge").innerHTML = `<svg viewBox="0 0 24 24" aria-hidden="true">${SHAPES[kind(data.status)]}</svg>${escape(data.status)}`;
const worst = (k) => kind(rows[k].s) === "bad" ? 0 : 1;  // failed ones first
const odd = rows.map((row, k) => k).filter((k) => rows[k].s !== "OK").sort((a, b) => worst(a) - worst(b) || a - b);
if (odd.length) {
  const alert = $("alert");
  alert.hidden = false;
  alert.className = kind(data.status);
  const lines = odd.slice(0, 5).map((k) => `<li><button type="button" data-case="${k}">case ${rows[k].k}</button>, ${escape(rows[k].s)}: ${escape(rows[k].w)}</li>`);
  alert.innerHTML = `<strong>${odd.length} of ${rows.length} ${data.repeats > 1 ? "points" : "cases"} not OK</strong><ul>${lines.join("")}</ul>`
    + (odd.length > 5 ? `<p>and ${odd.length - 5} more, in the table below</p>` : "");
  alert.addEventListener("click", (event) => { if (event.target.dataset.case) select(Number(event.target.dataset.case)); });
}

// --- choices ---------------------------------------------------------------------------------------------------------

const values = parameters.map((_, i) => [...new Set(rows.map((row) => row.v[i]))]);
values.forEach((list, i) => { if (!parameters[i].word) list.sort((a, b) => a - b); });
const numbers = parameters.map((_, i) => i).filter((i) => !parameters[i].word);
const state = { metric: 0, x: numbers[0] ?? 0, y: numbers[1] ?? -1, fixed: {}, chosen: -1, sort: -1, down: false };
const FEW = 40;

function options(label, id, list, value, change) {
  const holder = document.createElement("label"), chooser = document.createElement("select");
  chooser.id = id;
  for (const [key, text] of list) chooser.add(new Option(text, key, false, key === value));
  chooser.addEventListener("change", () => change(Number(chooser.value)));
  holder.append(`${label} `, chooser);
  return holder;
}

function choices() {
  const box = $("choices"), all = parameters.map((p, i) => [i, titled(p)]);
  box.replaceChildren();
  if (metrics.length > 1) box.append(options("Metric", "metric", metrics.map((m, i) => [i, titled(m)]), state.metric, (i) => set({ metric: i })));
  if (all.length > 1) {
    box.append(options("across", "across", all, state.x, (i) => set({ x: i, y: state.y === i ? -1 : state.y })));
    box.append(options("up", "up", [[-1, "the metric"], ...all.filter(([i]) => i !== state.x)], state.y, (i) => set({ y: i })));
  }
  parameters.forEach((p, i) => {
    if (i === state.x || i === state.y || values[i].length > FEW || values[i].length < 2) return;
    if (!(i in state.fixed)) state.fixed[i] = 0;
    const list = values[i].map((value, k) => [k, `${digits(value)} ${p.word || p.unit === "1" ? "" : p.unit}`]);
    box.append(options(p.name, `fixed-${i}`, list, state.fixed[i], (k) => set({ fixed: { ...state.fixed, [i]: k } })));
  });
}

/** Rows that the map shows. */
function visible() {
  const held = Object.entries(state.fixed).filter(([i]) => Number(i) !== state.x && Number(i) !== state.y && values[i].length <= FEW);
  return rows.map((_, k) => k).filter((k) => held.every(([i, at]) => rows[k].v[i] === values[i][at]));
}

// --- map -------------------------------------------------------------------------------------------------------------

const VIRIDIS = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"]
  .map((hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)));
function colour(share) {
  const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1), k = Math.min(Math.floor(place), VIRIDIS.length - 2), part = place - k;
  return `rgb(${VIRIDIS[k].map((c, i) => Math.round(c + part * (VIRIDIS[k + 1][i] - c))).join(",")})`;
}

/** An axis of a parameter or of the metric: places of values between two ends, and its ticks. */
function axis(list, word, log, from, to, pad = 0, own = false) {
  if (word) {
    const step = (to - from) / list.length;
    return { at: (v) => from + (list.indexOf(v) + .5) * step, ticks: list.map((v) => [v, String(v)]), step: () => [-step / 2, step / 2] };
  }
  const f = log ? Math.log10 : (v) => v;
  let low = f(Math.min(...list)), high = f(Math.max(...list));
  if (!(high > low)) { const room = Math.abs(low) || 1; low -= room / 2; high += room / 2; }
  const room = pad * (high - low);
  low -= room; high += room;
  const at = (v) => from + (f(v) - low) / (high - low) * (to - from);
  const raw = (high - low) / 6, power = 10 ** Math.floor(Math.log10(raw)), tick = [1, 2, 5, 10].find((m) => m * power >= raw) * power;
  const ticks = [];
  for (let k = Math.ceil(low / tick - 1e-9); k * tick <= high + 1e-9 * tick; k++) {
    const v = log ? 10 ** (k * tick) : k * tick;
    ticks.push([v, digits(Number(v.toPrecision(10)), 3)]);
  }
  if (own && list.length <= 8) ticks.splice(0, ticks.length, ...list.map((v) => [v, digits(v, 3)]));
  const places = list.map(at);
  const step = (v) => {
    const k = list.indexOf(v), half = (a, b) => (places[b] - places[a]) / 2;
    const before = k > 0 ? half(k - 1, k) : list.length > 1 ? half(0, 1) : (to - from) / 4;
    const after = k < list.length - 1 ? half(k, k + 1) : before;
    return [k > 0 ? -before : -after, after];
  };
  return { at, ticks, step };
}

let spots = [];
function draw() {
  const canvas = $("picture"), scale = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  canvas.width = w * scale; canvas.height = h * scale;
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  pen.font = "13px system-ui, sans-serif";
  pen.clearRect(0, 0, w, h);
  spots = [];
  if (!metrics.length || !parameters.length) { pen.fillText("no numbers to draw", 20, 30); return; }
  const flat = state.y < 0, shown = visible(), metric = metrics[state.metric];
  const known = shown.map((k) => rows[k].m[state.metric]).filter((v) => v !== null);
  const least = Math.min(...known), most = Math.max(...known);
  const left = 84, right = w - (flat ? 16 : 104), top = 14, bottom = h - 48;
  const p = parameters[state.x], q = flat ? null : parameters[state.y];
  const grid = (i) => !parameters[i].sampled;
  const cells = !flat && grid(state.x) && grid(state.y);
  const side = (i, a, b, pad) => axis(values[i], parameters[i].word, parameters[i].log, a, b, pad, cells);
  const pads = (i) => cells ? .5 / Math.max(values[i].length - 1, 1) : .03;
  const x = side(state.x, left, right, pads(state.x));
  const y = flat ? axis(known.length ? [least, most] : [0, 1], false, false, bottom, top, .06) : side(state.y, bottom, top, pads(state.y));
  pen.strokeStyle = "#c9d1d9"; pen.fillStyle = "#1b2733"; pen.lineWidth = 1;
  pen.strokeRect(left, top, right - left, bottom - top);
  pen.textAlign = "center";
  x.ticks.forEach(([v, text]) => { pen.fillText(text, x.at(v), bottom + 18); line(pen, x.at(v), bottom, x.at(v), bottom + 4); });
  pen.fillText(titled(p), (left + right) / 2, h - 8);
  pen.textAlign = "right";
  y.ticks.forEach(([v, text]) => { pen.fillText(text, left - 8, y.at(v) + 4); line(pen, left - 4, y.at(v), left, y.at(v)); });
  pen.save(); pen.translate(14, (top + bottom) / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center";
  pen.fillText(flat ? titled(metric) : titled(q), 0, 0); pen.restore();
  const share = (v) => most > least ? (v - least) / (most - least) : .5;
  if (flat) curve(pen, shown, x, y);
  for (const k of shown) {
    const row = rows[k], value = row.m[state.metric], px = x.at(row.v[state.x]);
    const py = flat ? (value === null ? bottom - 8 : y.at(value)) : y.at(row.v[state.y]);
    if (cells) {
      const [x0, x1] = x.step(row.v[state.x]), [y0, y1] = y.step(row.v[state.y]);
      pen.fillStyle = value === null ? "#d7dce1" : colour(share(value));
      pen.fillRect(px + x0, py + Math.min(y0, y1), x1 - x0 + .5, Math.abs(y1 - y0) + .5);
      spots.push({ k, x: px, y: py, x0: px + x0, x1: px + x1, y0: py + Math.min(y0, y1), y1: py + Math.max(y0, y1) });
    } else {
      pen.fillStyle = value === null ? "#d7dce1" : flat ? "#1b5faa" : colour(share(value));
      pen.beginPath(); pen.arc(px, py, 5, 0, 7); pen.fill();
      spots.push({ k, x: px, y: py });
    }
  }
  for (const spot of spots) mark(pen, spot);
  if (!flat && known.length) bar(pen, w - 88, top, bottom, least, most, titled(metric));
}

function line(pen, a, b, c, d) { pen.beginPath(); pen.moveTo(a, b); pen.lineTo(c, d); pen.stroke(); }

/** Lines between the cases of one value each of all other parameters, and bars of the standard error. */
function curve(pen, shown, x, y) {
  const order = shown.filter((k) => rows[k].m[state.metric] !== null).sort((a, b) => x.at(rows[a].v[state.x]) - x.at(rows[b].v[state.x]));
  const joined = !parameters[state.x].word && !parameters[state.x].sampled;
  pen.strokeStyle = "#1b5faa";
  pen.beginPath();
  order.forEach((k, n) => pen[n && joined ? "lineTo" : "moveTo"](x.at(rows[k].v[state.x]), y.at(rows[k].m[state.metric])));
  pen.stroke();
  for (const k of order) {
    const error = rows[k].e && rows[k].e[state.metric];
    if (error) line(pen, x.at(rows[k].v[state.x]), y.at(rows[k].m[state.metric] - error), x.at(rows[k].v[state.x]), y.at(rows[k].m[state.metric] + error));
  }
}

/** A cross, a triangle, and a frame around the chosen one: black on white, to be seen on any colour. */
function mark(pen, spot) {
  const what = kind(rows[spot.k].s);
  for (const [style, width] of [["#fff", 5], ["#000", 2]]) {
    pen.strokeStyle = style; pen.lineWidth = width;
    if (what === "bad") { line(pen, spot.x - 6, spot.y - 6, spot.x + 6, spot.y + 6); line(pen, spot.x - 6, spot.y + 6, spot.x + 6, spot.y - 6); }
    if (what === "doubt") { pen.beginPath(); pen.moveTo(spot.x, spot.y - 7); pen.lineTo(spot.x + 7, spot.y + 6); pen.lineTo(spot.x - 7, spot.y + 6); pen.closePath(); pen.stroke(); }
    if (spot.k === state.chosen) {
      if ("x0" in spot) pen.strokeRect(spot.x0 + 2, spot.y0 + 2, spot.x1 - spot.x0 - 4, spot.y1 - spot.y0 - 4);
      else { pen.beginPath(); pen.arc(spot.x, spot.y, 9, 0, 7); pen.stroke(); }
    }
  }
}

function bar(pen, left, top, bottom, least, most, title) {
  for (let k = 0; k < 64; k++) { pen.fillStyle = colour(k / 63); pen.fillRect(left, bottom - (k + 1) / 64 * (bottom - top), 16, (bottom - top) / 64 + 1); }
  pen.fillStyle = "#1b2733"; pen.textAlign = "left";
  for (let k = 0; k <= 4; k++) pen.fillText(digits(least + k / 4 * (most - least), 3), left + 21, bottom - k / 4 * (bottom - top) + (k === 4 ? 10 : k ? 4 : 0));
  pen.save(); pen.translate(left + 82, (top + bottom) / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center"; pen.fillText(title, 0, 0); pen.restore();
}

// --- one case --------------------------------------------------------------------------------------------------------

function select(k) {
  state.chosen = k;
  if (!visible().includes(k)) {
    for (const i in state.fixed) state.fixed[i] = values[i].indexOf(rows[k].v[i]);
    choices();
  }
  const row = rows[k], cell = (name, value, unit = "") => `<tr><td>${escape(name)}</td><td class="number">${value}</td><td>${escape(unit === "1" ? "" : unit)}</td></tr>`;
  const mean = (i) => row.m[i] === null ? "not known" : digits(row.m[i]) + (row.e && row.e[i] ? ` ± ${digits(row.e[i], 2)}` : "");
  const page = row.p ? `<p><a href="${escape(row.p)}">Open its report</a></p>` : "";
  $("numbers").innerHTML = `<h3 class="${kind(row.s)}">${shape(row.s)}case ${row.k}: ${escape(row.s)}</h3>`
    + (row.w ? `<p class="why">${escape(row.w)}</p>` : "") + page
    + `<table><tbody>${parameters.map((p, i) => cell(p.name, escape(digits(row.v[i], 12)), p.unit)).join("")}`
    + `${metrics.map((m, i) => cell(m.name, mean(i), m.unit)).join("")}${cell("run time", digits(row.t, 3), "s")}</tbody></table>`
    + `<h3>Run it alone</h3><code>${escape(command(row))}</code>`;
  document.querySelectorAll("#cases tr.chosen").forEach((line) => line.classList.remove("chosen"));
  const line = document.querySelector(`#cases tr[data-case="${k}"]`);
  if (line) line.classList.add("chosen");
  draw();
}

/** The command that runs one case, with what does not vary as it was given. */
function command(row) {
  const quoted = (text) => /^[\w@%+=:,./\-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`;
  const words = parameters.map((p, i) => data.places ? ["--set", `${p.name}=${row.v[i]}`] : [`--${p.name.replace(/_/g, "-")}`, String(row.v[i])]);
  return [data.command, ...words.flat().map(quoted), ...(row.seed === undefined ? [] : ["--seed", row.seed])].join(" ");
}

$("picture").addEventListener("click", (event) => {
  const box = $("picture").getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
  const inside = spots.find((s) => "x0" in s && px >= s.x0 && px <= s.x1 && py >= s.y0 && py <= s.y1);
  const near = spots.reduce((best, s) => { const d = Math.hypot(s.x - px, s.y - py); return d < best[0] ? [d, s] : best; }, [25, null])[1];
  if (inside || near) select((inside || near).k);
});
$("picture").addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step || !spots.length) return;
  const at = spots.findIndex((s) => s.k === state.chosen);
  select(spots[(Math.max(at, step > 0 ? at : 0) + step + spots.length) % spots.length].k);
  event.preventDefault();
});

// --- table -----------------------------------------------------------------------------------------------------------

const MOST = 1000;
const columns = [
  ["case", (row) => row.k], ...parameters.map((p, i) => [titled(p), (row) => row.v[i]]),
  ...metrics.map((m, i) => [titled(m), (row) => row.m[i]]), ["status", (row) => row.s],
];
function table() {
  const head = document.querySelector("#cases thead"), body = document.querySelector("#cases tbody");
  head.innerHTML = `<tr>${columns.map(([name], i) => `<th scope="col"${rows.length && typeof columns[i][1](rows[0]) === "number" ? ' class="number"' : ""}><button type="button" data-column="${i}">${escape(name)}${state.sort === i ? (state.down ? " \u25bc" : " \u25b2") : ""}</button></th>`).join("")}</tr>`;
  let order = rows.map((_, k) => k);
  if ($("odd").checked) order = order.filter((k) => rows[k].s !== "OK");
  if (state.sort >= 0) {
    const of = columns[state.sort][1], sign = state.down ? -1 : 1;
    order.sort((a, b) => { const [u, v] = [of(rows[a]), of(rows[b])]; return u === v ? a - b : u === null ? 1 : v === null ? -1 : (u < v ? -sign : sign); });
  }
  const cell = (value) => typeof value === "number" ? `<td class="number">${digits(value)}</td>` : `<td>${escape(value ?? "")}</td>`;
  body.innerHTML = order.slice(0, MOST).map((k) => `<tr data-case="${k}" tabindex="0"${k === state.chosen ? ' class="chosen"' : ""}>`
    + columns.slice(0, -1).map(([, of]) => cell(of(rows[k]))).join("") + `<td>${shape(rows[k].s)}${escape(rows[k].s)}</td></tr>`).join("");
  $("shown").textContent = order.length > MOST ? `the first ${MOST} of ${order.length}` : `${order.length} ${data.repeats > 1 ? "points" : "cases"}`;
}
document.querySelector("#cases thead").addEventListener("click", (event) => {
  const i = event.target.dataset.column;
  if (i === undefined) return;
  state.down = state.sort === Number(i) && !state.down;
  state.sort = Number(i);
  table();
});
const chosenLine = (event) => event.target.closest("tr")?.dataset.case;
document.querySelector("#cases tbody").addEventListener("click", (event) => { if (chosenLine(event)) select(Number(chosenLine(event))); });
document.querySelector("#cases tbody").addEventListener("keydown", (event) => {
  if (event.key === "Enter" && chosenLine(event)) select(Number(chosenLine(event)));
});
$("odd").addEventListener("change", table);

function set(change) { Object.assign(state, change); choices(); draw(); }
document.querySelector("#facts tbody").innerHTML = data.facts.map(([name, value]) => `<tr><td>${escape(name)}</td><td>${escape(value)}</td></tr>`).join("");
choices();
table();
select(odd[0] ?? 0);
window.addEventListener("resize", draw);
window.report = { select, set, state: () => state, spots: () => spots, command: (k) => command(rows[k]) };
