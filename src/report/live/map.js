// The plan: false colours, isolux lines, legend, luminaires and sensors.

const SVG = "http://www.w3.org/2000/svg";
const canvas = document.getElementById("canvas");
const stage = document.getElementById("stage");
const plan = document.getElementById("plan");
const tile = document.createElement("canvas");

/** An SVG element. */
function svg(name, attributes, ...children) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** Lux for a person. */
const lux = value => (Math.abs(value) < 9.95 ? value.toFixed(1) : value.toFixed(0)).replace(/^-(0(\.0)?)$/, "$1");

// --- scale -----------------------------------------------------------------------------------------------------------

/** 1, 2 or 5 times a power of ten, at or above a number. */
function roundStep(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return power * ([1, 2, 5].find(factor => factor * power >= number * (1 - 1e-9)) ?? 10);
}

/** Colours from 0 to `top`, and round ticks. */
class Scale {
  constructor(top, intervals = 7) {
    this.top = top > 0 ? top : 1;
    this.step = roundStep(this.top / intervals);
  }
  ticks() {
    return Array.from({ length: Math.floor(this.top / this.step + 1e-6) + 1 }, (_, i) => i * this.step);
  }
  label(tick) {
    return tick.toFixed(Math.max(0, -Math.floor(Math.log10(this.step) + 1e-9)));
  }
  index(value) {
    return clamp(Math.floor(value / this.top * 256), 0, 255);
  }
}

/** Viridis: as CSS colours, as pixels, and whether black is read on it. */
function palette(hex) {
  const parts = Array.from({ length: 256 }, (_, i) => hex.slice(6 * i, 6 * i + 6));
  const rgb = part => [0, 2, 4].map(at => parseInt(part.slice(at, at + 2), 16));
  return {
    css: parts.map(part => "#" + part),
    pixels: Uint32Array.from(parts, part => { const [r, g, b] = rgb(part); return (255 << 24 | b << 16 | g << 8 | r) >>> 0; }),
    isBright: parts.map(part => { const [r, g, b] = rgb(part); return 0.2126 * r + 0.7152 * g + 0.0722 * b > 125; }),
  };
}

// --- where things are ------------------------------------------------------------------------------------------------

const isLevel = ({ along, across }) => [along, across].every(side => Math.abs(side[2]) < 1e-6 * Math.hypot(...side));

/** Place on the picture's own axes, m: world x and y for a level plane, else along and across. */
function flat(plane, position) {
  if (isLevel(plane)) return [position[0], position[1]];
  const [u, v] = shares(plane, position);
  return [u * Math.hypot(...plane.along), v * Math.hypot(...plane.across)];
}

/** From shares of the plane's sides to pixels, and back. */
class View {
  constructor(plane, others, width, highest) {
    this.plane = plane;
    const corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(at => flat(plane, world(plane, at)));
    const range = (points, axis) => [Math.min(...points.map(p => p[axis])), Math.max(...points.map(p => p[axis]))];
    const own = [0, 1].map(axis => range(corners, axis));
    const margin = 0.25 * Math.max(...own.map(([low, high]) => high - low));
    const near = others.filter(point => own.every(([low, high], axis) => point[axis] > low - margin && point[axis] < high + margin));
    const [[x0, x1], [y0, y1]] = [0, 1].map(axis => range([...corners, ...near], axis));
    const border = 6;
    this.scale = Math.min((width - 2 * border) / (x1 - x0), (highest - 2 * border) / (y1 - y0));
    this.width = width;
    this.height = Math.ceil((y1 - y0) * this.scale + 2 * border);
    this.left = (width - (x1 - x0) * this.scale) / 2 - x0 * this.scale;
    this.top = border + y1 * this.scale;
    const [o, a, b] = [[0, 0], [1, 0], [0, 1]].map(at => this.pixel(flat(plane, world(plane, at))));
    this.origin = o;
    this.along = [a[0] - o[0], a[1] - o[1]];
    this.across = [b[0] - o[0], b[1] - o[1]];
  }
  /** Pixel of a place on the picture's axes. */
  pixel([x, y]) {
    return [this.left + x * this.scale, this.top - y * this.scale];
  }
  /** Pixel of shares of the plane's sides. */
  at([u, v]) {
    return [0, 1].map(i => this.origin[i] + u * this.along[i] + v * this.across[i]);
  }
  /** Shares of the plane's sides at a pixel. */
  shares([x, y]) {
    const [dx, dy] = [x - this.origin[0], y - this.origin[1]];
    const [[ax, ay], [bx, by]] = [this.along, this.across];
    const area = ax * by - ay * bx;
    return [(dx * by - dy * bx) / area, (ax * dy - ay * dx) / area];
  }
}

// --- isolux lines ----------------------------------------------------------------------------------------------------

/** Values smoothed once with weights 1 : 2 : 1 along and across, against noise; cells without a value stay out. */
function smoothed({ sum, mask, columns, rows }) {
  const pass = (values, step, isFirst, isLast) => {
    const result = new Float64Array(values.length);
    for (let row = 0, cell = 0; row < rows; row++) {
      for (let column = 0; column < columns; column++, cell++) {
        const own = values[cell];
        const before = !isFirst(column, row) && mask[cell - step] ? values[cell - step] : own;
        const after = !isLast(column, row) && mask[cell + step] ? values[cell + step] : own;
        result[cell] = (before + 2 * own + after) / 4;
      }
    }
    return result;
  };
  const along = pass(sum, 1, column => column === 0, column => column === columns - 1);
  return pass(along, columns, (_, row) => row === 0, (_, row) => row === rows - 1);
}

/** Lines on which the values reach a level: marching squares between cell centres, joined. Points in cells. */
function contours(values, mask, columns, rows, level) {
  // Edges between neighbouring centres: 2 · cell to the right, 2 · cell + 1 upwards; each meets up to two others.
  const links = new Int32Array(4 * columns * rows).fill(-1);
  const edges = [];
  const link = (from, to) => {
    const isFirst = links[2 * from] < 0;
    if (isFirst) edges.push(from);
    links[2 * from + (isFirst ? 0 : 1)] = to;
  };
  const join = (a, b) => { link(a, b); link(b, a); };
  for (let row = 0; row + 1 < rows; row++) {
    for (let column = 0; column + 1 < columns; column++) {
      const a = row * columns + column, b = a + 1, d = a + columns, c = d + 1;
      const above = (values[a] >= level ? 1 : 0) | (values[b] >= level ? 2 : 0) | (values[c] >= level ? 4 : 0) | (values[d] >= level ? 8 : 0);
      if (above === 0 || above === 15 || !(mask[a] && mask[b] && mask[c] && mask[d])) continue;
      const bottom = 2 * a, right = 2 * b + 1, top = 2 * d, left = 2 * a + 1;
      switch (above > 7 ? 15 - above : above) {
        case 1: join(left, bottom); break;
        case 2: join(bottom, right); break;
        case 3: join(left, right); break;
        case 4: join(right, top); break;
        case 6: join(bottom, top); break;
        case 7: join(left, top); break;
        default: { // a saddle: the middle decides
          const middle = (values[a] + values[b] + values[c] + values[d]) / 4 >= level;
          if (middle === (above === 5)) { join(left, top); join(bottom, right); }
          else { join(left, bottom); join(right, top); }
        }
      }
    }
  }
  const point = edge => {
    const a = edge >> 1, b = edge & 1 ? a + columns : a + 1;
    const share = (level - values[a]) / (values[b] - values[a]), x = a % columns, y = Math.floor(a / columns);
    return edge & 1 ? [x, y + share] : [x + share, y];
  };
  const walk = start => {
    const line = [];
    for (let edge = start; edge >= 0;) {
      line.push(point(edge));
      const next = links[2 * edge] >= 0 ? links[2 * edge] : links[2 * edge + 1];
      links[2 * edge] = links[2 * edge + 1] = -1;
      if (next >= 0) {
        if (links[2 * next] === edge) links[2 * next] = -1;
        else if (links[2 * next + 1] === edge) links[2 * next + 1] = -1;
      }
      edge = next;
    }
    return line;
  };
  const lines = [];
  for (const edge of edges) if (links[2 * edge] >= 0 && links[2 * edge + 1] < 0) lines.push(walk(edge));
  for (const edge of edges) {
    if (links[2 * edge] < 0) continue;
    const line = walk(edge);
    lines.push([...line, line[0]]);
  }
  return lines;
}

const lengthOf = line => line.reduce((sum, p, i) => (i ? sum + Math.hypot(p[0] - line[i - 1][0], p[1] - line[i - 1][1]) : 0), 0);

/** Where a label stands on a line: flat, inside, apart from the others, near where it was; null if nowhere. */
function labelPlace(line, size, isFree, taken, before) {
  let best = null, least = Infinity;
  const stride = Math.max(1, Math.floor(line.length / 60));
  for (let i = 0; i < line.length; i += stride) {
    const [x, y] = line[i];
    if (!isFree([x, y], size)) continue;
    if (taken.some(([tx, ty]) => Math.abs(tx - x) < size[0] + 24 && Math.abs(ty - y) < size[1] + 24)) continue;
    const reach = line[Math.min(i + 3, line.length - 1)], from = line[Math.max(i - 3, 0)];
    const slope = Math.abs(reach[1] - from[1]) / (Math.hypot(reach[0] - from[0], reach[1] - from[1]) || 1);
    const moved = before.reduce((near, [bx, by]) => Math.min(near, Math.hypot(bx - x, by - y)), before.length ? Infinity : 0);
    const cost = 60 * slope + moved;
    if (cost < least) { best = [x, y]; least = cost; }
  }
  return best;
}

/** Labels of the lines where they were last, by level. */
let labelsBefore = new Map();

function drawLines(context, view, scale, colours) {
  const { plane } = view, { columns, rows, mask } = plane;
  const values = smoothed(plane), taken = [], labels = new Map();
  context.font = "600 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const toPixel = ([x, y]) => view.at([(x + 0.5) / columns, (y + 0.5) / rows]);
  const isInside = pixel => view.shares(pixel).every(share => share >= 0 && share <= 1);
  const covers = [...view.bodies, ...view.plates];
  const isFree = ([x, y], [w, h]) => isInside([x - w, y - h]) && isInside([x + w, y + h])
    && covers.every(([x0, y0, x1, y1]) => x + w < x0 || x - w > x1 || y + h < y0 || y - h > y1);
  const written = [];
  for (const level of scale.ticks().slice(1)) {
    const index = scale.index(level), ink = colours.isBright[index] ? "#0a0a0a" : "#ffffff";
    const lines = contours(values, mask, columns, rows, level).map(line => line.map(toPixel));
    context.strokeStyle = ink;
    context.globalAlpha = 0.7;
    context.lineWidth = 1.1;
    context.beginPath();
    for (const line of lines) line.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
    const label = scale.label(level), size = [context.measureText(label).width / 2 + 4, 8], places = [];
    const longest = lines.map(line => ({ line, long: lengthOf(line) })).filter(({ long }) => long > 8 * size[0]);
    for (const { line } of longest.sort((a, b) => b.long - a.long).slice(0, 4)) {
      const place = labelPlace(line, size, isFree, taken, labelsBefore.get(level) ?? []);
      if (!place) continue;
      taken.push(place);
      places.push(place);
      written.push({ label, place, size, index, ink });
    }
    labels.set(level, places);
  }
  context.globalAlpha = 1;
  for (const { label, place: [x, y], size, index, ink } of written) {
    context.fillStyle = colours.css[index];
    context.fillRect(x - size[0], y - size[1], 2 * size[0], 2 * size[1]);
    context.fillStyle = ink;
    context.fillText(label, x, y + 0.5);
  }
  labelsBefore = labels;
}

// --- picture ---------------------------------------------------------------------------------------------------------

/** Makes a canvas as sharp as the screen; its context in CSS pixels. */
function sharpContext(element, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (element.width !== w || element.height !== h) Object.assign(element, { width: w, height: h });
  const context = element.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

function drawMap(view, scale, colours, withLines) {
  const { plane } = view, { columns, rows, sum, mask } = plane;
  if (tile.width !== columns || tile.height !== rows) Object.assign(tile, { width: columns, height: rows });
  const image = new ImageData(columns, rows), pixels = new Uint32Array(image.data.buffer);
  for (let cell = 0; cell < pixels.length; cell++) pixels[cell] = mask[cell] ? colours.pixels[scale.index(sum[cell])] : 0;
  tile.getContext("2d").putImageData(image, 0, 0);
  const context = sharpContext(canvas, view.width, view.height);
  const [a, b] = [view.along, view.across];
  context.save();
  context.transform(a[0] / columns, a[1] / columns, b[0] / rows, b[1] / rows, ...view.origin);
  context.imageSmoothingEnabled = mask.every(value => value); // without: cells keep sharp borders to those without a value
  context.drawImage(tile, 0, 0);
  context.restore();
  if (withLines) drawLines(context, view, scale, colours);
}

function drawLegend(scale, colours) {
  const element = document.getElementById("legend");
  const width = element.clientWidth, height = element.clientHeight;
  const context = sharpContext(element, width, height);
  const left = 8, right = width - 34, bar = 12;
  for (let x = left; x < right; x++) {
    context.fillStyle = colours.css[Math.floor((x - left) / (right - left) * 256)];
    context.fillRect(x, 0, 1.5, bar);
  }
  context.fillStyle = getComputedStyle(element).color;
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const tick of scale.ticks()) {
    const x = left + tick / scale.top * (right - left);
    context.fillRect(Math.round(x) - 0.5, bar, 1, 4);
    context.fillText(scale.label(tick), x, bar + 7);
  }
  context.textAlign = "left";
  context.fillText("lx", right + 14, bar + 7);
}

// --- luminaires and sensors in the plan ------------------------------------------------------------------------------

/** More luminaires than this may cover labels. */
const MOST_BODIES = 60;

/** Outlines of the luminaires; returns for each what shows its level. */
function drawLamps(view, lamps, layer) {
  layer.replaceChildren();
  view.bodies = [];
  view.plates = [];
  return lamps.map(lamp => {
    const group = svg("g", { class: "lamp", "data-lamp": lamp.index }, svg("title", {}));
    for (const outline of isLevel(view.plane) ? lamp.outlines : []) {
      const points = outline.map(point => view.pixel(point));
      const [low, high] = [Math.min, Math.max].map(end => [0, 1].map(i => end(...points.map(p => p[i]))));
      const middle = [0, 1].map(i => (low[i] + high[i]) / 2);
      if (lamps.length <= MOST_BODIES) view.bodies.push([...low, ...high]);
      const extent = Math.max(...points.map(p => Math.hypot(p[0] - middle[0], p[1] - middle[1])));
      const [cx, cy] = middle;
      if (extent < 11) group.append(svg("circle", { class: "touch", cx, cy, r: 13 }));
      if (extent < 2.5) {
        group.append(svg("circle", { class: "halo", cx, cy, r: 4 }), svg("circle", { class: "body", cx, cy, r: 4 }));
      } else {
        const path = points.map(point => point.map(value => value.toFixed(1)).join(",")).join(" ");
        group.append(svg("polygon", { class: "halo", points: path }), svg("polygon", { class: "body", points: path }));
      }
    }
    layer.append(group);
    return group;
  });
}

/** A luminaire's outline is as bright as it is. */
function showLamp(group, lamp, level) {
  const mix = (dark, bright) => Math.round(dark + (bright - dark) * level);
  group.style.fill = "";
  for (const body of group.querySelectorAll(".body")) body.style.fill = `rgb(${mix(38, 255)} ${mix(38, 250)} ${mix(44, 222)})`;
  group.classList.toggle("off", level === 0);
  group.firstChild.textContent = `${lamp.name}: ${percent(level)}`;
}

/** Signs that tell met, too low and too high without colour. */
const SIGNS = { met: "M-3.4 .2 L-1 2.7 L3.5 -2.4", low: "M0 -3.6 V3.2 M-3 .4 L0 3.4 L3 .4", high: "M0 3.6 V-3.2 M-3 -.4 L0 -3.4 L3 -.4", open: "M-3.4 1 Q-1.7 -2 0 0 T3.4 -1", "": "" };

/** A sensor's mark and plate, once; they are filled and moved later. */
function sensorMark(sensor, layer, homes) {
  const part = {
    home: svg("circle", { class: "home", r: 7 }),
    ring: svg("circle", { class: "ring", r: 12 }),
    mark: svg("circle", { class: "mark", r: 7.5 }),
    sign: svg("path", { class: "sign" }),
    plate: svg("rect", { class: "plate", rx: 4, height: 32 }),
    name: svg("text", { x: 6, dy: 13 }),
    value: svg("tspan", { class: "value" }),
    goal: svg("tspan", { class: "goal" }),
  };
  const touch = svg("circle", { class: "touch", r: 18 });
  part.label = svg("g", { class: "label" }, part.plate, part.name, svg("text", { x: 6, dy: 27 }, part.value, part.goal));
  part.group = svg("g", { class: "sensor", "data-sensor": sensor.index }, touch, part.label, part.ring, part.mark, part.sign);
  part.name.textContent = sensor.name.length > 16 ? sensor.name.slice(0, 15) + "…" : sensor.name;
  homes.append(part.home);
  layer.append(part.group);
  return part;
}

/** Pixel of a sensor; null where it isn't in this picture. */
function sensorPixel(view, sensor, plane) {
  const onPlane = sensor.plane !== null && plane === view.plane;
  if (onPlane) return view.at(sensor.moved ?? sensor.place);
  if (!isLevel(view.plane)) return null;
  const position = sensor.moved ? world(plane, sensor.moved) : sensor.position;
  return view.pixel(flat(view.plane, position));
}

/** Puts each plate beside its mark where it covers least of the others. */
function placeLabels(view, parts) {
  const shown = parts.filter(part => part.at), isDense = plan.classList.contains("dense"); // then one is seen at a time
  const marks = (isDense ? [] : shown).map(({ at: [x, y] }) => [x - 10, y - 10, x + 10, y + 10]);
  const overlap = (a, b) => Math.max(0, Math.min(a[2], b[2]) - Math.max(a[0], b[0])) * Math.max(0, Math.min(a[3], b[3]) - Math.max(a[1], b[1]));
  const placed = [];
  shown.forEach((part, index) => {
    const [x, y] = part.at, w = part.width, h = 32;
    const around = [[12, -16], [-12 - w, -16], [-w / 2, 12], [-w / 2, -12 - h], [9, 9], [-9 - w, 9], [9, -9 - h], [-9 - w, -9 - h]];
    const boxes = around.map(([dx, dy]) => [x + dx, y + dy, x + dx + w, y + dy + h]);
    const cost = (box, rank) => {
      const outside = Math.max(0, -box[0], box[2] - view.width) + Math.max(0, -box[1], box[3] - view.height);
      const others = placed.reduce((sum, other) => sum + overlap(box, other), 0);
      return 40 * outside + 3 * others + marks.reduce((sum, mark, i) => sum + (i === index ? 0 : 3 * overlap(box, mark)), 0) + rank;
    };
    const costs = boxes.map(cost), best = costs.indexOf(Math.min(...costs));
    if (!isDense) placed.push(boxes[best]);
    part.label.setAttribute("transform", `translate(${around[best].map(value => value.toFixed(1)).join(" ")})`);
  });
  view.plates = placed;
}
