// Sliders beside the report: each change is a run of its own, which takes the place of the one before on the page.
{
  const own = data, sliders = own.sliders, values = Object.fromEntries(sliders.map((s) => [s.path, s.value]));
  let busy = false, again = false, judging = 0, changes = 0;
  window.explore = { answers: 0, judged: 0, state: () => ({ now: !!bins, ghost: !!ghost, values, playing: clock.playing, busy, box: motion && boxOf() }) };
  document.querySelector("main").insertBefore($("turn"), $("signals")); // behind the picture on a phone
  document.querySelector("main").after($("measures"));
  $("badge").replaceChildren();
  clock.loop = true;

  async function ask(name) {
    const answer = await fetch(name, { method: "POST", body: JSON.stringify(values) });
    return answer.json();
  }
  function say(text, wrong = false) { $("status").textContent = text; $("status").classList.toggle("wrong", wrong); }
  function verdict(found, more) { say(`${found.status}${found.message ? ": " + found.message : ""} ${more}`, !found.ok); }

  /** Show a run. */
  function take(found) {
    const first = !bins;
    use(runOf(found));
    if (first) data.signals.first.forEach((name) => chosen.add(name));
    showRun(); seek(first ? start : clock.time); drawLegend();
    if (first && !calm.matches) play();
  }

  /** Run with the newest values; while such a run is under way, only the newest change waits. */
  async function move() {
    changes += 1;
    if (busy) { again = true; return; }
    busy = true; again = false; clearTimeout(judging);
    try {
      const found = await ask("move");
      if (found.wrong) say(found.wrong, true);
      else { take(found); verdict(found, `(${found.seconds.toFixed(2)} s; its error follows)`); }
      window.explore.answers += 1;
    } catch { say("the server has ended", true); }
    busy = false;
    if (again) move(); else judging = setTimeout(judge, 600);
  }

  /** Show the run with its error, unless a number has changed by then. */
  async function judge() {
    const asked = changes;
    try {
      const found = await ask("judge");
      if (asked !== changes || found.late) return;
      if (found.wrong) { say(found.wrong, true); return; }
      take(found);
      verdict(found, `(error of the motion ${found.error === null ? "unknown" : found.error.toExponential(1)})`);
      window.explore.judged += 1;
    } catch { say("the server has ended", true); }
  }

  function turn(s, value) {
    if (!ghost && bins) ghost = current;
    values[s.path] = value; s.place(); move();
  }

  let group = "";
  for (const s of sliders) {
    const parts = s.path.split("."), cut = Math.min(2, parts.length - 1), heading = parts.slice(0, cut).join("."), name = parts.slice(cut).join(".");
    if (heading !== group) wrapped(element("h3", "", $("sliders")), group = heading);
    const label = element("label", "", $("sliders")), row = element("div", "", $("sliders"));
    const slide = element("input", "", row), box = element("input", "", row);
    element("span", s.unit === "1" ? "" : s.unit, row).className = "unit";
    wrapped(label, name);
    row.className = "bar"; label.htmlFor = s.path;
    Object.assign(slide, { type: "range", min: 0, max: 1000, id: s.path });
    Object.assign(box, { type: "number", step: "any" });
    box.setAttribute("aria-label", `${s.path} in ${s.unit}`);
    s.place = () => {
      slide.value = 1000 * (values[s.path] - s.low) / (s.high - s.low);
      box.value = Number((values[s.path] / s.factor).toPrecision(5));
      slide.setAttribute("aria-valuetext", `${box.value} ${s.unit}`);
    };
    slide.addEventListener("input", () => turn(s, s.low + slide.value / 1000 * (s.high - s.low)));
    box.addEventListener("change", () => { if (Number.isFinite(box.valueAsNumber)) turn(s, box.valueAsNumber * s.factor); });
    s.place();
  }
  $("keep").onclick = () => { if (bins) { ghost = current; makePlots(); drawScene(); } };
  $("reset").onclick = () => { for (const s of sliders) { values[s.path] = s.value; s.place(); } move(); };
  $("save").onclick = async () => { const found = await ask("save"); say(found.wrong || `saved as ${found.saved}`, !!found.wrong); };
  say("The first picture waits for the compiled solver, a minute or two where it was not used before.");
  move();
}
