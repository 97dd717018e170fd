"use strict";
// What is in the page, and what follows from it: levels, light, power.

const text = id => document.getElementById(id).textContent;
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Bytes that were deflated and put into base64. */
async function inflated(base64) {
  const bytes = Uint8Array.from(atob(base64), letter => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Reads layer after layer; how they are packed is told in layers.rs. */
function layerReader(bytes) {
  let at = 0;
  const difference = () => {
    let value = 0, scale = 1, byte;
    do {
      byte = bytes[at++];
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte & 128);
    return value % 2 ? -(value + 1) / 2 : value / 2;
  };
  const expected = (steps, cell, columns) => {
    const column = cell % columns;
    if (cell < columns) return column ? steps[cell - 1] : 0;
    if (!column) return steps[cell - columns];
    const left = steps[cell - 1], above = steps[cell - columns];
    return clamp(left + above - steps[cell - columns - 1], Math.min(left, above), Math.max(left, above));
  };
  return (columns, rows, step, Numbers) => {
    const steps = new Float64Array(columns * rows);
    for (let cell = 0; cell < steps.length; cell++) steps[cell] = expected(steps, cell, columns) + difference();
    return Numbers.from(steps, value => value * step);
  };
}

/** Everything the page knows. Vectors have one number for each luminaire, or group where those are put together. */
async function loadScene() {
  const scene = JSON.parse(text("scene"));
  const read = layerReader(await inflated(text("layers")));
  const lamps = scene.luminaires;
  for (const plane of scene.planes) {
    plane.mask = read(plane.columns, plane.rows, 1, Uint8Array);
    plane.offset = read(plane.columns, plane.rows, plane.step, Float32Array);
    plane.error = read(plane.columns, plane.rows, plane.error_step, Float32Array);
    plane.layers = lamps.map(() => read(plane.columns, plane.rows, plane.step, Float32Array));
    plane.sum = Float64Array.from(plane.offset);
    plane.shown = null;
  }
  const rows = step => (scene.sensors.length ? read(lamps.length, scene.sensors.length, step, Float64Array) : []);
  const influence = rows(scene.influence_step), errors = rows(scene.error_step);
  const told = Array.from({ length: scene.renders }, () => rows(scene.error_step));
  scene.sensors.forEach((sensor, index) => {
    sensor.index = index;
    const own = all => all.slice(index * lamps.length, (index + 1) * lamps.length);
    sensor.own = { row: own(influence), error: own(errors), told: told.map(own), offset: sensor.offset };
    sensor.fileTarget = sensor.target;
    sensor.moved = null;
    Object.assign(sensor, sensor.own);
    const plane = scene.planes[sensor.plane];
    sensor.place = plane ? shares(plane, sensor.position) : null;
  });
  lamps.forEach((lamp, index) => { lamp.index = index; });
  scene.groups = [...new Set(lamps.map(lamp => lamp.group))]
    .map(name => ({ name, members: lamps.filter(lamp => lamp.group === name) }));
  scene.levels = Float64Array.from(lamps, lamp => admitted(lamp, lamp.level));
  scene.fullPower = lamps.reduce((sum, lamp) => sum + watts(lamp, 1), 0);
  return scene;
}

// --- luminaires ------------------------------------------------------------------------------------------------------

/** The nearest level a luminaire can have: off, or from its lowest level to full. */
function admitted(lamp, level) {
  if (level >= lamp.least) return Math.min(level, 1);
  return level < lamp.least / 2 ? 0 : lamp.least;
}

/** Power of a luminaire at a level, W. */
function watts(lamp, level) {
  if (level <= 0) return lamp.off;
  const points = lamp.power;
  const after = points.findIndex(([known]) => known >= level);
  if (after < 0) return points.at(-1)[1];
  if (after === 0) return points[0][1];
  const [a, low] = points[after - 1], [b, high] = points[after];
  return low + (high - low) * (level - a) / (b - a);
}

const totalWatts = (lamps, levels) => lamps.reduce((sum, lamp) => sum + watts(lamp, levels[lamp.index]), 0);

// --- planes ----------------------------------------------------------------------------------------------------------

/** Brings a plane's sum up to date: from scratch, so that nothing is left of earlier levels. */
function refresh(plane, levels) {
  if (plane.shown?.every((level, index) => level === levels[index])) return;
  const { sum } = plane;
  sum.set(plane.offset);
  plane.layers.forEach((layer, index) => {
    const level = levels[index];
    if (level === 0) return;
    for (let cell = 0; cell < sum.length; cell++) sum[cell] += level * layer[cell];
  });
  plane.shown = levels.slice();
}

/** Where the mean is less, lx, ratios are those of rounding. */
const LEAST_MEAN = 1;

/** Ē, E_min, E_max over the cells with a value, U₀, and errors (1 σ) of the darkest cell and of U₀; null without any. */
function figures(plane) {
  let sum = 0, least = Infinity, most = -Infinity, count = 0, darkest = 0;
  for (let cell = 0; cell < plane.sum.length; cell++) {
    if (!plane.mask[cell]) continue;
    const value = plane.sum[cell];
    sum += value;
    count++;
    if (value < least) { least = value; darkest = cell; }
    if (value > most) most = value;
  }
  if (!count) return null;
  const mean = sum / count, leastError = plane.error[darkest] * Math.max(least - plane.offset[darkest], 0);
  const ratio = mean >= LEAST_MEAN ? { uniformity: Math.max(least, 0) / mean, uniformityError: leastError / mean } : {};
  return { mean, least, most, leastError, ...ratio };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Where a place in the world is on a plane, in shares of its sides. */
function shares(plane, position) {
  const from = position.map((value, axis) => value - plane.corner[axis]);
  return [plane.along, plane.across].map(side => dot(from, side) / dot(side, side));
}

/** The place in the world at shares of a plane's sides. */
const world = (plane, [u, v]) => plane.corner.map((value, axis) => value + u * plane.along[axis] + v * plane.across[axis]);

/** The cells around a place and their weights, bilinear, over cells with a value; null where there is none. */
function around(plane, [u, v]) {
  const { columns, rows, mask } = plane;
  const cell = (share, count) => clamp(Math.floor(share * count), 0, count - 1);
  if (!mask[cell(v, rows) * columns + cell(u, columns)]) return null;
  const between = (share, count) => {
    const at = clamp(share * count - 0.5, 0, count - 1), low = Math.min(Math.floor(at), Math.max(count - 2, 0));
    return [low, Math.min(low + 1, count - 1), at - low];
  };
  const [x0, x1, fx] = between(u, columns), [y0, y1, fy] = between(v, rows);
  const corners = [[y0 * columns + x0, (1 - fx) * (1 - fy)], [y0 * columns + x1, fx * (1 - fy)],
    [y1 * columns + x0, (1 - fx) * fy], [y1 * columns + x1, fx * fy]].filter(([index]) => mask[index]);
  const total = corners.reduce((sum, [, weight]) => sum + weight, 0);
  return total > 0 ? corners.map(([index, weight]) => [index, weight / total]) : null;
}

const weighted = (values, corners) => corners.reduce((sum, [index, weight]) => sum + values[index] * weight, 0);

// --- sensors ---------------------------------------------------------------------------------------------------------

/** What a sensor reads, lx. */
function reading(sensor, levels) {
  let sum = sensor.offset;
  for (let index = 0; index < levels.length; index++) sum += sensor.row[index] * levels[index];
  return sum;
}

/** Standard error (1 σ) of what a sensor reads, lx: errors of luminaires add in squares, less what renders said of their sum. */
function errorOf(sensor, levels) {
  let variance = 0;
  for (let index = 0; index < levels.length; index++) variance += (sensor.error[index] * levels[index]) ** 2;
  for (const part of sensor.told) variance -= part.reduce((sum, entry, index) => sum + entry * levels[index], 0) ** 2;
  return Math.sqrt(Math.max(variance, 0));
}

/** Moves a sensor along its plane; it then reads the map. False where no light can be. */
function move(sensor, plane, place) {
  const to = place.map(share => clamp(share, 0, 1));
  const corners = around(plane, to);
  if (!corners) return false;
  sensor.moved = to;
  sensor.row = Float64Array.from(plane.layers, layer => weighted(layer, corners));
  // Errors of a cell's layers are known together only: as if all were off the same way.
  const share = weighted(plane.error, corners), lamps = Math.sqrt(sensor.row.length);
  sensor.error = sensor.row.map(value => share * value * lamps);
  sensor.told = [];
  sensor.offset = weighted(plane.offset, corners);
  return true;
}

/** Puts a sensor back to its place, where it reads what was computed for it. */
function putBack(sensor) {
  sensor.moved = null;
  Object.assign(sensor, sensor.own);
}

/** Lux that count as reached: what rounding to the page's steps may cost. */
const SLACK = 0.05;

/** By how much a sensor has to be above its target, lx, so that a render that checks it finds it met; and below the most allowed. */
function margins(sensor, levels) {
  const error = errorOf(sensor, levels);
  return [scene.sigmas * Math.hypot(error, sensor.noise ?? error), scene.sigmas * error];
}

/** "met", "low", "high" with the confidence asked for, "open" where the error is too large to say, "" without a target. */
function state(sensor, levels) {
  if (sensor.target === null) return "";
  const value = reading(sensor, levels), [spare, doubt] = margins(sensor, levels);
  const most = sensor.tolerance === null ? Infinity : sensor.target + sensor.tolerance;
  if (value + doubt < sensor.target - SLACK) return "low";
  if (value - doubt > most + SLACK) return "high";
  return value - spare >= sensor.target - SLACK && value + doubt <= most + SLACK ? "met" : "open";
}
