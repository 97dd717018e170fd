// The page itself: controls, keys, files, and one redraw for whatever changed.

const $ = id => document.getElementById(id);
const percent = level => `${(100 * level).toFixed(Math.abs(1000 * level - 10 * Math.round(100 * level)) < 0.5 ? 0 : 1)} %`;
const power = value => (value < 99.95 ? value.toFixed(1) : value.toFixed(0)) + " " + scene.unit;

/** An HTML element; properties are set, children appended. */
function html(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

/** Time the search for the least power may take, ms. */
const PATIENCE = 3000;
/** More sensors than this show their plates only when pointed at. */
const MOST_PLATES = 40;
/** More luminaires than this start folded in their groups. */
const MOST_OPEN = 40;
/** Steps that can be undone. */
const MOST_UNDO = 50;

let scene, plane, view, scale, colours, marks, outlines;
let chosen = -1;
let redraw = { layout: true };
const rows = [], groupRows = [], sensorRows = [];
const undo = [];

// --- changes ---------------------------------------------------------------------------------------------------------

let pending = false;
/** Draws before the next frame. */
function schedule() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; render(); });
}

let lastGesture = {};
/** Keeps the dimming for undo; the steps of one gesture on one control are one. */
function remember(control) {
  const now = performance.now();
  const same = control && lastGesture.control === control && now - lastGesture.time < 800;
  lastGesture = { control, time: now };
  if (same) return;
  undo.push(scene.levels.slice());
  if (undo.length > MOST_UNDO) undo.shift();
  $("undo").disabled = false;
}

/** Sets levels of luminaires: `[index, level]` each, brought to what each can be. */
function dim(changes, control) {
  remember(control);
  for (const [index, level] of changes) scene.levels[index] = admitted(scene.luminaires[index], level);
  say("");
  schedule();
}

const dimAll = level => dim(scene.luminaires.map(lamp => [lamp.index, level]));

/** Off, or back to the level before. */
function toggle(lamp) {
  const level = scene.levels[lamp.index];
  if (level > 0) lamp.before = level;
  dim([[lamp.index, level > 0 ? 0 : lamp.before ?? 1]]);
}

function takeBack() {
  const levels = undo.pop();
  if (!levels) return;
  scene.levels.set(levels);
  lastGesture = {};
  $("undo").disabled = undo.length === 0;
  say("");
  schedule();
}

/** The line below the buttons; kind: "", "good" or "bad". */
function say(message, kind = "") {
  const line = $("message");
  if (line.textContent === message && line.className === kind) return;
  line.textContent = message;
  line.className = kind;
}

// --- drawing ---------------------------------------------------------------------------------------------------------

/** Brings everything on the screen up to date. */
function render() {
  if (plane) {
    refresh(plane, scene.levels);
    if (redraw.layout && !layOut()) return; // it is drawn once there is room
    const found = figures(plane);
    showFigures(found);
    chooseScale(found);
    drawMap(view, scale, colours, $("lines").checked);
  }
  showLevels();
  showSensors();
  showPointer();
  redraw = {};
}

/** Size of the picture, and everything whose place depends on it; false as long as the page has none. */
function layOut() {
  if (stage.clientWidth < 1) return false;
  const wide = matchMedia("(min-width: 901px)").matches;
  const points = [
    ...(isLevel(plane) ? scene.luminaires.flatMap(lamp => lamp.outlines.flat()) : []),
    ...scene.sensors.filter(sensor => scene.planes[sensor.plane] === plane).map(sensor => flat(plane, sensor.position)),
  ];
  view = new View(plane, points, stage.clientWidth, Math.max(240, wide ? innerHeight - 250 : 0.8 * innerHeight));
  stage.style.height = `${view.height}px`;
  plan.setAttribute("viewBox", `0 0 ${view.width} ${view.height}`);
  labelsBefore = new Map();
  outlines = drawLamps(view, scene.luminaires, plan.querySelector(".lamps"));
  shown.fill(NaN);
  redraw.legend = redraw.plates = true;
  return true;
}

/** The scale follows the map, or stays. */
function chooseScale(found) {
  const most = found ? found.most : 1;
  if ($("fit").checked) $("top").value = roundTop(most);
  const top = Number($("top").value) > 0 ? Number($("top").value) : roundTop(most);
  if (scale?.top === top && !redraw.legend) return;
  scale = new Scale(top, view.width < 420 ? 6 : 10);
  drawLegend(scale, colours);
}

/** Two digits, rounded up. */
function roundTop(most) {
  if (!(most > 0)) return 1;
  const unit = 10 ** (Math.floor(Math.log10(most)) - 1);
  return Math.ceil(most / unit - 1e-9) * unit;
}

function showFigures(found) {
  const values = found ? [found.mean, Math.max(found.least, 0), found.most].map(value => `${lux(value)} lx`) : ["–", "–", "–"];
  ["mean", "least", "most"].forEach((id, i) => { $(id).textContent = values[i]; });
  const known = found?.uniformity !== undefined;
  $("uniformity").textContent = known ? found.uniformity.toFixed(2) : "–";
  $("errors").textContent = found
    ? `σ of the darkest cell: ${lux(found.leastError)} lx${known ? `, of U₀ ± ${found.uniformityError.toFixed(3)}` : ""}. The least of many cells reads low by about as much.`
    : "";
}

/** Levels that are on the screen. */
let shown;

function showLevels() {
  const changed = scene.luminaires.filter(lamp => shown[lamp.index] !== scene.levels[lamp.index]);
  for (const lamp of changed) {
    const level = scene.levels[lamp.index];
    shown[lamp.index] = level;
    if (outlines) showLamp(outlines[lamp.index], lamp, level);
    showRow(rows[lamp.index], level);
    if (lamp.index === chosen) showRow(chosenRow, level);
  }
  for (const group of new Set(changed.map(lamp => lamp.group))) showGroup(group);
  const watts = totalWatts(scene.luminaires, scene.levels);
  $("watts").textContent = power(watts);
  const share = scene.fullPower > 0 ? watts / scene.fullPower : 0;
  $("share").textContent = `${(100 * share).toFixed(1)} % of full ${power(scene.fullPower)}`;
  $("meter").style.transform = `scaleX(${clamp(share, 0, 1)})`;
}

function showRow(row, level) {
  if (!row) return;
  row.element.classList.toggle("is-off", level === 0);
  row.toggle.checked = level > 0;
  if (Number(row.slider.value) !== Math.round(1000 * level)) row.slider.value = Math.round(1000 * level);
  row.slider.setAttribute("aria-valuetext", level > 0 ? percent(level) : "off");
  row.output.textContent = level > 0 ? percent(level) : "off";
}

function showGroup(name) {
  const row = groupRows.find(row => row.group.name === name);
  if (!row) return;
  const levels = row.group.members.map(lamp => scene.levels[lamp.index]);
  showRow(row, Math.max(...levels));
  const on = levels.filter(level => level > 0).length;
  row.toggle.indeterminate = on > 0 && on < levels.length;
  if (Math.min(...levels) < Math.max(...levels)) row.output.textContent = `≤ ${row.output.textContent}`;
}

/** Readings in the table and in the plan. */
function showSensors() {
  scene.sensors.forEach((sensor, index) => {
    const value = reading(sensor, scene.levels), kind = state(sensor, scene.levels), row = sensorRows[index];
    const difference = value - sensor.target;
    const verdict = { "": "", met: "✓ met", open: "≈ not decided", low: `▼ ${lux(-difference)} short`, high: `▲ ${lux(difference - (sensor.tolerance ?? 0))} over` }[kind];
    setText(row.value, lux(value));
    setText(row.error, lux(errorOf(sensor, scene.levels)));
    setText(row.verdict, verdict);
    row.verdict.className = `state ${kind}`;
    row.back.hidden = !sensor.moved;
    if (plane) showMark(sensor, marks[index], value, kind);
  });
  if (redraw.plates && plane) {
    placeLabels(view, marks);
    schedule(); // labels of isolux lines keep off the plates
  }
}

const setText = (element, content) => { if (element.textContent !== content) element.textContent = content; };
const setAttribute = (element, name, value) => { if (element.getAttribute(name) !== value) element.setAttribute(name, value); };

function showMark(sensor, part, value, kind) {
  const own = scene.planes[sensor.plane];
  part.at = sensorPixel(view, sensor, own);
  part.group.style.display = part.at ? "" : "none";
  part.home.style.display = part.at && sensor.moved ? "" : "none";
  if (!part.at) return;
  const free = own === plane;
  const place = free ? "free" : own ? "elsewhere" : "";
  setAttribute(part.group, "class", `sensor ${kind} ${place} ${part.held ? "held" : ""}`);
  setAttribute(part.group, "transform", `translate(${part.at.map(x => x.toFixed(1)).join(" ")})`);
  const [hx, hy] = view.pixel(flat(plane, sensor.position));
  setAttribute(part.home, "transform", `translate(${hx.toFixed(1)} ${hy.toFixed(1)})`);
  setAttribute(part.sign, "d", SIGNS[kind]);
  const goal = sensor.target === null ? "" : ` / ${lux(sensor.target)}`;
  setText(part.value, lux(value));
  setText(part.goal, `${goal} lx`);
  const letters = part.value.textContent.length + part.goal.textContent.length;
  const width = 8 * Math.ceil((Math.max(part.name.textContent.length, letters) * 6.6 + 12) / 8);
  if (width !== part.width) {
    part.width = width;
    part.plate.setAttribute("width", width);
    redraw.plates = true;
  }
  const asked = sensor.target === null ? "no target" : `target ${lux(sensor.target)} lx, ${{ met: "met", open: "not decided", low: "too low", high: "too high" }[kind]}`;
  setAttribute(part.group, "aria-label", `Sensor ${sensor.name}: ${lux(value)} lx, ${asked}${free ? "; arrow keys move it" : ""}`);
}

// --- controls --------------------------------------------------------------------------------------------------------

/** Switch, name, slider and level in one row; `set(level)` and `flip()` do what they say. */
function controlRow(name, label, set, flip) {
  const toggle = html("input", { type: "checkbox", className: "switch" });
  const slider = html("input", { type: "range", min: 0, max: 1000, step: 1 });
  const output = html("output");
  toggle.setAttribute("role", "switch");
  toggle.setAttribute("aria-label", `${label} on`);
  slider.setAttribute("aria-label", `${label}, dimming`);
  toggle.addEventListener("change", flip);
  slider.addEventListener("input", () => set(slider.value / 1000));
  slider.addEventListener("change", () => { lastGesture = {}; });
  slider.addEventListener("keydown", event => {
    const steps = { ArrowLeft: -10, ArrowDown: -10, ArrowRight: 10, ArrowUp: 10, PageDown: -100, PageUp: 100 };
    const step = steps[event.key] * (event.shiftKey ? 0.1 : 1);
    if (!step || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    set(clamp(Number(slider.value) + step, 0, 1000) / 1000, step);
  });
  const element = html("div", { className: "row" }, toggle, name, slider, output);
  return { element, toggle, slider, output };
}

/** A level below the lowest is that or off; a step by key from off must get there. */
function stepped(lamp, level, step) {
  if (!step || level >= lamp.least) return level;
  return step > 0 ? Math.max(level, lamp.least) : 0;
}

function lampRow(lamp) {
  const name = html("span", { className: "name", textContent: lamp.name, title: lamp.name });
  const set = (level, step) => dim([[lamp.index, stepped(lamp, level, step)]], lamp);
  return controlRow(name, lamp.name, set, () => toggle(lamp));
}

function groupRow(group, members) {
  const name = html("button", { type: "button", className: "fold", textContent: group.name, title: group.name });
  name.setAttribute("aria-expanded", String(!members.hidden));
  name.addEventListener("click", () => {
    members.hidden = !members.hidden;
    name.setAttribute("aria-expanded", String(!members.hidden));
  });
  let start = null;
  const set = (level, step) => {
    const levels = group.members.map(lamp => scene.levels[lamp.index]);
    const highest = Math.max(...levels);
    if (!$("proportions").checked || (highest === 0 && !start)) {
      dim(group.members.map(lamp => [lamp.index, stepped(lamp, level, step)]), group);
      return;
    }
    // Proportions are those at the start of the gesture: nothing is lost on the way down.
    if (lastGesture.control !== group || !start || step) start = { levels, highest };
    dim(group.members.map((lamp, i) => [lamp.index, start.levels[i] * level / start.highest]), group);
  };
  const flip = () => {
    const on = group.members.some(lamp => scene.levels[lamp.index] > 0);
    for (const lamp of group.members) if (scene.levels[lamp.index] > 0) lamp.before = scene.levels[lamp.index];
    dim(group.members.map(lamp => [lamp.index, on ? 0 : lamp.before ?? 1]));
  };
  const row = controlRow(name, `Group ${group.name}`, set, flip);
  row.element.classList.add("group");
  row.slider.addEventListener("change", () => { start = null; });
  return { ...row, group };
}

function buildLamps() {
  const list = $("lamps");
  for (const group of scene.groups) {
    const alone = group.members.length === 1;
    const members = html("div", { className: "members", hidden: scene.luminaires.length > MOST_OPEN });
    if (!alone) {
      const row = groupRow(group, members);
      groupRows.push(row);
      list.append(row.element);
    }
    for (const lamp of group.members) {
      rows[lamp.index] = lampRow(lamp);
      (alone ? list : members).append(rows[lamp.index].element);
    }
    if (!alone) list.append(members);
  }
  $("proportions").parentElement.hidden = groupRows.length === 0;
}

let chosenRow = null;
/** The luminaire whose slider stands under the map. */
function choose(lamp) {
  for (const index of [chosen, lamp.index]) {
    if (index < 0) continue;
    outlines?.[index].classList.toggle("chosen", index === lamp.index);
    rows[index].element.classList.toggle("chosen", index === lamp.index);
  }
  chosen = lamp.index;
  chosenRow = lampRow(lamp);
  $("chosen").replaceChildren(chosenRow.element);
  showRow(chosenRow, scene.levels[lamp.index]);
  const row = rows[chosen].element, list = $("lamps");
  if (row.offsetParent && list.scrollHeight > list.clientHeight) {
    list.scrollTop += row.getBoundingClientRect().top - list.getBoundingClientRect().top - list.clientHeight / 2;
  }
}

function buildSensors() {
  const table = $("sensors");
  $("sensors-card").hidden = scene.sensors.length === 0;
  const head = html("tr", {}, ...["Sensor", "lx", "σ", "Target", ""].map(title => html("th", { textContent: title, scope: "col" })));
  head.lastChild.setAttribute("aria-label", "Met");
  const body = html("tbody");
  table.append(html("thead", {}, head), body);
  for (const sensor of scene.sensors) {
    const target = html("input", { type: "number", min: 0, step: "any", value: sensor.target ?? "", placeholder: "–", inputMode: "decimal" });
    target.setAttribute("aria-label", `Target of ${sensor.name}, lx`);
    target.addEventListener("input", () => {
      const asked = target.value === "" && !target.validity.badInput ? null : target.valueAsNumber;
      const sound = asked === null || asked >= 0;
      target.setAttribute("aria-invalid", String(!sound));
      if (sound) sensor.target = asked;
      say(sound ? "" : `Target of ${sensor.name}: found ${target.validity.badInput ? "no number" : target.value}, expected 0 lx or more; it stays ${sensor.target === null ? "without one" : `${lux(sensor.target)} lx`}.`, sound ? "" : "bad");
      schedule();
    });
    const back = html("button", { type: "button", className: "back", textContent: "↺", title: "Back to its place", hidden: true });
    back.setAttribute("aria-label", `Put ${sensor.name} back to its place`);
    back.addEventListener("click", () => returnHome(sensor));
    const value = html("td"), error = html("td", { className: "error" }), verdict = html("td", { className: "state" });
    const name = html("td", { title: sensor.tolerance === null ? sensor.name : `${sensor.name}: at most ${lux(sensor.tolerance)} lx above its target` }, sensor.name, back);
    body.append(html("tr", {}, name, value, error, html("td", {}, target), verdict));
    sensorRows.push({ value, error, verdict, target, back });
  }
}

function returnHome(sensor) {
  putBack(sensor);
  redraw.plates = true;
  schedule();
}

function buildPlan() {
  const homes = svg("g", { "aria-hidden": "true" }), sensors = svg("g", {});
  plan.replaceChildren(svg("g", { class: "lamps", "aria-hidden": "true" }), homes, sensors);
  marks = scene.sensors.map(sensor => {
    const part = sensorMark(sensor, sensors, homes);
    if (scene.planes[sensor.plane]) makeDraggable(sensor, part);
    return part;
  });
  plan.classList.toggle("dense", scene.sensors.length > MOST_PLATES);
  plan.addEventListener("click", event => {
    const group = event.target.closest(".lamp");
    if (!group) return;
    const lamp = scene.luminaires[Number(group.dataset.lamp)];
    if (chosen === lamp.index) toggle(lamp);
    else choose(lamp);
  });
}

/** A sensor that follows pointer and arrow keys over its plane. */
function makeDraggable(sensor, part) {
  const own = scene.planes[sensor.plane], { group } = part;
  group.setAttribute("tabindex", "0");
  group.setAttribute("role", "button");
  const to = place => {
    if (move(sensor, own, place)) {
      redraw.plates = true;
      say("");
      schedule();
    }
  };
  group.addEventListener("pointerdown", event => {
    if (own !== plane || event.button > 0) return;
    part.held = pointerPixel(event).map((x, i) => x - part.at[i]);
    group.setPointerCapture(event.pointerId);
    group.focus({ focusVisible: false });
    event.preventDefault();
  });
  group.addEventListener("pointermove", event => {
    if (part.held) to(view.shares(pointerPixel(event).map((x, i) => x - part.held[i])));
  });
  for (const end of ["pointerup", "pointercancel"]) group.addEventListener(end, () => { part.held = null; schedule(); });
  group.addEventListener("keydown", event => {
    if (own !== plane) return;
    if (event.key === "Escape") return returnHome(sensor);
    const direction = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!direction) return;
    event.preventDefault();
    const pixels = (event.shiftKey ? 0.5 : 0.1) * view.scale;
    to(view.shares(part.at.map((x, i) => x + direction[i] * pixels)));
  });
}

/** Where the pointer is in the picture. */
function pointerPixel(event) {
  const box = stage.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

/** Where the pointer is over the map, pixels; null elsewhere. */
let pointer = null;

/** E under the pointer. */
function showPointer() {
  const place = pointer && view ? view.shares(pointer) : [-1, -1];
  const inside = place.every(share => share >= 0 && share <= 1);
  const corners = inside && around(plane, place);
  const [x, y] = inside ? flat(plane, world(plane, place)) : [];
  const shown = inside ? `(${x.toFixed(2)}, ${y.toFixed(2)}) m: ${corners ? `${lux(weighted(plane.sum, corners))} lx` : "no light here"}` : "";
  setText($("pointer"), shown);
}

function choosePlane(index) {
  plane = scene.planes[index];
  $("plane").value = index;
  redraw.layout = true;
  schedule();
}

// --- meet the targets ------------------------------------------------------------------------------------------------

/** Least power for the targets: the file's own solution as long as it holds, else solved here. */
async function meet() {
  if (!scene.sensors.length) return say("There is no sensor, so there is no target to meet.", "bad");
  if (scene.sensors.every(sensor => sensor.target === null)) return say("No sensor has a target: type one into the table of sensors.", "bad");
  if (scene.optimum && scene.sensors.every(sensor => !sensor.moved && sensor.target === sensor.fileTarget)) {
    dim(scene.optimum.map((level, index) => [index, level]));
    return tell({ levels: scene.levels, short: shortOf(scene.sensors, scene.levels) }, "as the command solved it");
  }
  say("Searching for the least power …");
  $("meet").disabled = true;
  await new Promise(done => setTimeout(done, 30)); // the line above is drawn first
  const start = performance.now();
  const found = meetTargets(scene.luminaires, scene.sensors, PATIENCE);
  $("meet").disabled = false;
  dim([...found.levels].map((level, index) => [index, level]));
  const time = performance.now() - start;
  const how = found.proven ? `solved here in ${time < 950 ? `${Math.ceil(time)} ms` : `${(time / 1000).toFixed(1)} s`}`
    : `search ended after ${(time / 1000).toFixed(1)} s, at most ${(100 * found.above).toFixed(1)} % above the least`;
  return tell(found, how);
}

/** Says how a search ended. */
function tell({ levels, short }, how) {
  const watts = totalWatts(scene.luminaires, levels);
  if (!short.length) {
    const share = scene.fullPower > 0 ? `, ${(100 * watts / scene.fullPower).toFixed(1)} % of full output` : "";
    return say(`Targets met with ${power(watts)}${share}; ${how}.`, "good");
  }
  const each = short.slice(0, 5).map(({ sensor, value, error, most, state }) => {
    const exact = Math.abs(sensor.target - value) < 1 ? number => number.toFixed(1) : lux;
    const wanted = `${sensor.name} ${exact(value)} ${state === "open" ? `± ${lux(error)} ` : ""}of ${exact(sensor.target)} lx`;
    return most < sensor.target ? `${wanted} (at most ${exact(most)})` : wanted;
  });
  const more = short.length > 5 ? `, and ${short.length - 5} more` : "";
  const what = short.some(({ state }) => state !== "open") ? "Not all targets can be met" : "Not all targets are surely met";
  return say(`${what}: ${each.join(", ")}${more}. This is as near as they get; ${how}.`, "bad");
}

// --- files -----------------------------------------------------------------------------------------------------------

/** The dimming as luxmap reads it. */
function dimmingJson() {
  const levels = scene.luminaires.flatMap(lamp => lamp.names.map(name => [name, scene.levels[lamp.index]]));
  return JSON.stringify({ dimming: Object.fromEntries(levels) }, null, 2) + "\n";
}

function save() {
  const url = URL.createObjectURL(new Blob([dimmingJson()], { type: "application/json" }));
  html("a", { href: url, download: "dimming.json" }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
  say("Saved as dimming.json.", "good");
}

/** Levels that a file asks for, `[index, level]` each. Throws a line that tells what is wrong. */
function dimmingFrom(content) {
  let file;
  try {
    file = JSON.parse(content);
  } catch (error) {
    throw new Error(`found no JSON (${error.message}), expected {"dimming": {"luminaire": level, …}}`);
  }
  const asked = file?.dimming;
  if (typeof asked !== "object" || asked === null || Array.isArray(asked)) {
    throw new Error('found no "dimming", expected {"dimming": {"luminaire": level, …}}');
  }
  const owner = new Map(scene.luminaires.flatMap(lamp => lamp.names.map(name => [name, lamp])));
  const found = new Map();
  for (const [name, level] of Object.entries(asked)) {
    const lamp = owner.get(name);
    if (!lamp) throw new Error(`found “${name}”, expected a luminaire of this page, such as “${owner.keys().next().value}”`);
    if (typeof level !== "number" || !(level >= 0 && level <= 1)) {
      throw new Error(`found ${JSON.stringify(level)} for “${name}”, expected a level from 0 to 1`);
    }
    if (level > 0 && level < lamp.least - 1e-9) {
      throw new Error(`found ${level} for “${name}”, expected 0 or at least ${lamp.least}, its lowest level`);
    }
    found.set(lamp, [...(found.get(lamp) ?? []), level]);
  }
  return [...found].map(([lamp, levels]) => [lamp.index, levels.reduce((sum, level) => sum + level, 0) / levels.length]);
}

/** Takes the dimming of a file, or says in one line why not. */
async function load(file) {
  try {
    const changes = dimmingFrom(await file.text());
    dim(changes);
    say(`Loaded ${file.name}: ${changes.length} of ${scene.luminaires.length} levels.`, "good");
  } catch (error) {
    say(`${file.name}: ${error.message}; nothing was changed.`.replace(/\s+/g, " "), "bad");
  }
}

// --- the page --------------------------------------------------------------------------------------------------------

const isDark = () => (document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";

function switchTheme() {
  document.documentElement.dataset.theme = isDark() ? "light" : "dark";
  showTheme();
}

function showTheme() {
  $("theme").textContent = isDark() ? "Light" : "Dark";
  redraw.legend = true;
  schedule();
}

const nextPlane = () => plane && choosePlane((scene.planes.indexOf(plane) + 1) % scene.planes.length);
const click = id => () => $(id).click();
const KEYS = { m: meet, z: takeBack, s: save, o: click("file"), p: nextPlane, i: click("lines"), f: click("fit"), d: switchTheme, "?": () => $("help").showModal() };

function onKey(event) {
  const typing = event.target.closest?.("input[type=number], select, dialog");
  const action = KEYS[event.key];
  if (!action || typing || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  action();
}

function connect() {
  const on = (id, action, event = "click") => $(id).addEventListener(event, action);
  on("meet", meet);
  on("undo", takeBack);
  on("all-on", () => dimAll(1));
  on("all-off", () => dimAll(0));
  on("save", save);
  on("load", click("file"));
  on("file", () => {
    if ($("file").files[0]) load($("file").files[0]);
    $("file").value = "";
  }, "change");
  on("theme", switchTheme);
  on("help-button", () => $("help").showModal());
  on("plane", () => choosePlane(Number($("plane").value)), "change");
  on("lines", schedule, "change");
  on("fit", schedule, "change");
  on("top", () => { $("fit").checked = false; schedule(); }, "input");
  on("stage", event => { pointer = pointerPixel(event); showPointer(); }, "pointermove");
  on("stage", () => { pointer = null; showPointer(); }, "pointerleave");
  document.addEventListener("keydown", onKey);
  document.addEventListener("dragover", event => { event.preventDefault(); document.body.classList.add("drop"); });
  document.addEventListener("dragleave", event => { if (!event.relatedTarget) document.body.classList.remove("drop"); });
  document.addEventListener("drop", event => {
    event.preventDefault();
    document.body.classList.remove("drop");
    if (event.dataTransfer.files[0]) load(event.dataTransfer.files[0]);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", showTheme);
  new ResizeObserver(() => { redraw.layout = true; schedule(); }).observe(stage.parentElement);
  addEventListener("resize", () => { redraw.layout = true; schedule(); });
}

async function start() {
  scene = await loadScene();
  shown = new Float64Array(scene.luminaires.length).fill(NaN);
  colours = palette(scene.colours);
  $("about").textContent = scene.about;
  $("notes").hidden = scene.notes.length === 0;
  $("notes").append(...scene.notes.map(note => html("li", { textContent: note })));
  $("plane").append(...scene.planes.map((plane, index) => html("option", { value: index, textContent: plane.name })));
  $("plane-label").hidden = scene.planes.length < 2;
  $("chosen").textContent = scene.luminaires.length ? "Choose a luminaire in the plan to dim it here; choose it again to switch it." : "";
  document.querySelector(".map").hidden = scene.planes.length === 0;
  plane = scene.planes[0] ?? null;
  buildLamps();
  buildSensors();
  buildPlan();
  if (plane) {
    refresh(plane, scene.levels);
    const asked = Math.max(0, ...scene.sensors.map(sensor => 1.25 * (sensor.target ?? 0)));
    $("top").value = roundTop(Math.max(figures(plane)?.most ?? 0, asked));
  }
  showTheme();
  connect();
  render();
}

/** Ends when the page can be used. */
const ready = start();
