// Least power that gives every sensor its target: branch and bound over a dual simplex.
//
// A luminaire is off or between its lowest level and 1; its power is piecewise linear. On each branch a luminaire may have
// an interval of levels, off or not; the lower convex hull of its power over them makes a linear program whose value is a
// bound. Where the hull lies below the true power, or a level is between off and the lowest, the interval is divided.

/** Bounds and rows of a linear program for the dual simplex: cost, columns (of rows), highest value of each column. */
class Program {
  constructor(rows) {
    this.low = rows.map(row => row.low);
    this.high = rows.map(row => row.high);
    this.cost = [];
    this.most = [];
    this.columns = [];
  }
  add(column, cost, most) {
    this.columns.push(column);
    this.cost.push(cost);
    this.most.push(most);
  }
}

/**
 * Least cost with every row between its bounds and every column between 0 and its highest value: the bounded dual simplex
 * on a dense tableau. It starts with each column at the end its cost wants, so it is dual feasible from the start.
 * Returns the columns' values; null if there are none.
 */
function leastCost({ low, high, cost, most, columns }) {
  const rows = low.length, count = columns.length, tiny = 1e-9;
  const table = low.map((_, row) => Float64Array.from(columns, column => column[row]));
  const reduced = Float64Array.from(cost);
  // A column of the table holds the variable `inside[column]`, a row `basis[row]`: numbers from `count` on are the rows'.
  const inside = Int32Array.from(columns, (_, column) => column);
  const basis = Int32Array.from(low, (_, row) => count + row);
  const from = variable => (variable < count ? 0 : low[variable - count]);
  const to = variable => (variable < count ? most[variable] : high[variable - count]);
  const atTop = Uint8Array.from(columns, (_, column) => (cost[column] < 0 ? 1 : 0));
  const value = Float64Array.from(table, row => row.reduce((sum, entry, column) => sum + (atTop[column] ? entry * most[column] : 0), 0));

  /** The row furthest out of its bounds, measured by how fast its entries can move it. */
  const worstRow = () => {
    let worst = -1, most = 0;
    for (let row = 0; row < rows; row++) {
      const away = Math.max(from(basis[row]) - value[row], value[row] - to(basis[row]));
      if (away <= 1e-7) continue;
      const entries = table[row];
      let norm = 1;
      for (let column = 0; column < count; column++) norm += entries[column] * entries[column];
      if (away * away > most * norm) { worst = row; most = away * away / norm; }
    }
    return worst;
  };
  const width = column => to(inside[column]) - from(inside[column]);
  /** Columns that can move a row towards its bound, nearest ratio first. */
  const movers = (entries, rising) => {
    const found = [];
    for (let column = 0; column < count; column++) {
      const entry = rising ? entries[column] : -entries[column];
      if (atTop[column] ? entry > -tiny : entry < tiny) continue;
      if (width(column) > 0) found.push({ column, size: Math.abs(entry), ratio: Math.abs(reduced[column] / entry) });
    }
    return found.sort((a, b) => a.ratio - b.ratio || b.size - a.size);
  };
  /** The column that enters: those before it go to their other end, as they would not bring the row home. */
  const entering = (entries, rising, away) => {
    const candidates = movers(entries, rising);
    if (candidates.reduce((sum, { column, size }) => sum + size * width(column), 0) < away - 1e-7) return -1;
    let passed = 0;
    for (; passed < candidates.length - 1; passed++) {
      const { column, size } = candidates[passed];
      if (size * width(column) >= away) break;
      away -= size * width(column);
    }
    candidates.slice(0, passed).forEach(({ column }) => {
      const change = atTop[column] ? -width(column) : width(column);
      for (let row = 0; row < rows; row++) value[row] += table[row][column] * change;
      atTop[column] = 1 - atTop[column];
    });
    return candidates.length ? candidates[passed].column : -1;
  };

  for (let left = 60 * (rows + count) + 1000; ; left--) {
    const row = worstRow();
    if (row < 0) break;
    if (left === 0) return null;
    const leaving = basis[row], rising = value[row] < from(leaving);
    const away = rising ? from(leaving) - value[row] : value[row] - to(leaving);
    const entries = table[row], column = entering(entries, rising, away);
    if (column < 0) return null;
    const pivot = entries[column], variable = inside[column];
    const start = atTop[column] ? to(variable) : from(variable);
    const change = ((rising ? from(leaving) : to(leaving)) - value[row]) / pivot;
    for (let other = 0; other < rows; other++) value[other] += table[other][column] * change;
    value[row] = start + change;
    // The row, solved for what enters.
    for (let k = 0; k < count; k++) entries[k] /= -pivot;
    entries[column] = 1 / pivot;
    const substitute = numbers => {
      const factor = numbers[column];
      if (factor === 0) return;
      numbers[column] = 0;
      for (let k = 0; k < count; k++) numbers[k] += factor * entries[k];
    };
    for (let other = 0; other < rows; other++) if (other !== row) substitute(table[other]);
    substitute(reduced);
    basis[row] = variable;
    inside[column] = leaving;
    atTop[column] = rising ? 0 : 1;
  }
  const found = new Float64Array(count);
  for (let column = 0; column < count; column++) {
    if (inside[column] < count) found[inside[column]] = atTop[column] ? to(inside[column]) : 0;
  }
  for (let row = 0; row < rows; row++) if (basis[row] < count) found[basis[row]] = clamp(value[row], 0, most[basis[row]]);
  return found;
}

/** Lower convex hull of points that rise in x. */
function lowerHull(points) {
  const hull = [];
  for (const point of points) {
    while (hull.length > 1) {
      const [a, b] = hull.slice(-2);
      if ((b[1] - a[1]) * (point[0] - a[0]) < (point[1] - a[1]) * (b[0] - a[0])) break;
      hull.pop();
    }
    hull.push(point);
  }
  return hull;
}

/** Levels and powers a luminaire may have on a branch: off, an interval, or both. */
function allowed(lamp, { off, low, high }) {
  const points = off ? [[0, lamp.off]] : [];
  if (low > high) return points;
  if (low > 0 || !off) points.push([low, low > 0 ? watts(lamp, low) : lamp.power[0][1]]);
  for (const point of lamp.power) if (point[0] > low && point[0] < high) points.push(point);
  if (high > low) points.push([high, watts(lamp, high)]);
  return points;
}

/** Height of a hull at a level. */
function height(hull, level) {
  const after = hull.findIndex(([x]) => x >= level);
  if (after <= 0) return hull[Math.max(after, 0)][1];
  const [a, b] = [hull[after - 1], hull[after]];
  return a[1] + (b[1] - a[1]) * (level - a[0]) / (b[0] - a[0]);
}

/** Most lux by which the program may leave a row's bounds. */
const TOLERANCE = 1e-4;

/**
 * Levels of least power.
 *
 * lamps: as in the scene; rows: `{ row, low, high }`, lx, for `row · levels`; milliseconds: time there is.
 * elastic: rows may be missed, at a cost above all power for each lux. above: share by which this may exceed the least.
 * Returns `{ levels, watts, proven, above }`, or null where rows can't be kept (or nothing was found in time).
 */
function leastPower(lamps, rows, milliseconds, elastic = false) {
  const end = performance.now() + milliseconds;
  const full = lamps.reduce((sum, lamp) => sum + Math.abs(watts(lamp, 1)) + Math.abs(lamp.off), 0) || 1;
  const penalty = 10 * full, close = 1e-6 * full;
  const columns = lamps.map((_, lamp) => rows.map(({ row }) => row[lamp]));

  /** The linear program of a branch: its bound and levels. */
  const relaxed = branch => {
    const hulls = lamps.map((lamp, index) => lowerHull(allowed(lamp, branch[index])));
    const base = rows.map(({ row }) => hulls.reduce((sum, hull, lamp) => sum + row[lamp] * hull[0][0], 0));
    const program = new Program(rows.map(({ low, high }, index) => ({ low: low - base[index], high: high - base[index] })));
    const owner = [];
    hulls.forEach((hull, lamp) => {
      for (let i = 1; i < hull.length; i++) {
        const length = hull[i][0] - hull[i - 1][0];
        program.add(columns[lamp], (hull[i][1] - hull[i - 1][1]) / length, length);
        owner.push(lamp);
      }
    });
    if (elastic) {
      rows.forEach((row, index) => {
        const unit = sign => rows.map((_, other) => (other === index ? sign : 0));
        program.add(unit(1), penalty, Math.max(row.low, 0) + 1e6);
        if (row.high < Infinity) program.add(unit(-1), penalty, 1e9);
      });
    }
    const found = leastCost(program);
    if (!found) return null;
    const levels = Float64Array.from(hulls, hull => hull[0][0]);
    owner.forEach((lamp, column) => { levels[lamp] += found[column]; });
    const bound = hulls.reduce((sum, hull, lamp) => sum + height(hull, levels[lamp]), 0);
    return { branch, hulls, levels, bound: bound + (elastic ? missed(levels) * penalty : 0) };
  };
  /** Lux beyond the bounds, over all rows. */
  const missed = levels => rows.reduce((sum, { row, low, high }) => {
    const value = levels.reduce((light, level, lamp) => light + row[lamp] * level, 0);
    return sum + Math.max(low - value, value - high, 0);
  }, 0);

  let best = null;
  /** Keeps levels that are allowed if they are the best so far. */
  const propose = levels => {
    const away = missed(levels);
    if (!elastic && away > TOLERANCE * (rows.length || 1)) return;
    const own = totalWatts(lamps, levels), cost = own + (elastic ? away * penalty : 0);
    if (!best || cost < best.cost) best = { levels, watts: own, cost };
  };
  /** Two ways to levels that are allowed: those too low raised, and the rest optimised with the same luminaires off. */
  const round = ({ levels, branch }) => {
    propose(levels.map((level, lamp) => (level > 1e-9 ? Math.max(level, lamps[lamp].least) : 0)));
    const fixed = branch.map(({ high }, lamp) => {
      const on = levels[lamp] > 1e-9, least = lamps[lamp].least;
      return { off: !on, low: on ? least : 2, high: Math.max(high, least) };
    });
    const again = relaxed(fixed);
    if (again) propose(again.levels);
  };
  /** Where to divide: the luminaire whose power is furthest above the hull, and its two intervals. */
  const divided = ({ levels, hulls, branch }) => {
    let worst = -1, most = close / lamps.length / 10;
    lamps.forEach((lamp, index) => {
      const { off, low, high } = branch[index];
      if (low > high) return;
      const level = levels[index];
      const gap = level <= 1e-9 && off ? 0 : watts(lamp, Math.max(level, low)) - height(hulls[index], level);
      const between = off && level > 1e-9 && level < low - 1e-9;
      if (Math.max(gap, between ? 2 * most : 0) > most) { worst = index; most = gap; }
    });
    if (worst < 0) return null;
    const { off, low, high } = branch[worst];
    const parts = off
      ? [{ off: true, low: 2, high: 0 }, { off: false, low, high }]
      : split(lamps[worst], low, high, levels[worst]).map(([from, to]) => ({ off: false, low: from, high: to }));
    return parts.map(part => branch.map((own, index) => (index === worst ? part : own)));
  };

  const root = relaxed(lamps.map(lamp => ({ off: true, low: lamp.least, high: 1 })));
  if (!root) return null;
  const open = [root];
  let turns = 0, bound = root.bound, proven = true;
  const everyTurn = lamps.length * rows.length < 2000;
  while (open.length) {
    let next = 0;
    open.forEach((node, index) => { if (node.bound < open[next].bound) next = index; });
    const [node] = open.splice(next, 1);
    bound = node.bound;
    if (best && node.bound >= best.cost - close) break;
    if (everyTurn || turns % 8 === 0) round(node);
    if (turns++ > 0 && performance.now() > end) { proven = false; break; }
    const children = divided(node);
    if (!children) { propose(node.levels); continue; }
    for (const child of children) {
      const solved = relaxed(child);
      if (solved && !(best && solved.bound >= best.cost - close)) open.push(solved);
    }
  }
  return best && { levels: best.levels, watts: best.watts, proven, above: proven ? 0 : best.cost / bound - 1 };
}

/** An interval divided at the bend of the power nearest to a level, or at the level. */
function split(lamp, low, high, level) {
  const inside = lamp.power.map(([x]) => x).filter(x => x > low + 1e-9 && x < high - 1e-9);
  const nearest = inside.reduce((a, b) => (Math.abs(b - level) < Math.abs(a - level) ? b : a), inside[0] ?? (low + high) / 2);
  return [[low, nearest], [nearest, high]];
}

/** Sensors whose targets are not surely met, each with what it gets, its error, and the most it can get. */
function shortOf(sensors, levels) {
  const of = sensor => ({
    sensor,
    value: reading(sensor, levels),
    error: errorOf(sensor, levels),
    most: sensor.row.reduce((sum, lux) => sum + Math.max(lux, 0), sensor.offset),
    state: state(sensor, levels),
  });
  return sensors.map(of).filter(({ state }) => state !== "met" && state !== "");
}

/** Rounds in which the margins, which depend on the levels, settle. */
const MARGIN_ROUNDS = 4;

/**
 * Levels for the sensors' targets by a margin of `scene.sigmas` errors, the nearest to them where they can't be met.
 * Returns `{ levels, watts, proven, above, short }`; short: see `shortOf`.
 */
function meetTargets(lamps, sensors, milliseconds) {
  const asked = sensors.filter(sensor => sensor.target !== null), each = milliseconds / MARGIN_ROUNDS;
  const none = [0, 0], within = ([low, high], [most, least]) => low <= most && high <= least;
  let moved = asked.map(() => none), found = null;
  for (let round = 0; round < MARGIN_ROUNDS; round++) {
    found = solved(lamps, asked, moved, each);
    const needed = asked.map(sensor => room(sensor, margins(sensor, found.levels)));
    if (needed.every((own, index) => within(own, moved[index]))) break;
    moved = needed.map(own => own.map(margin => 1.03 * margin)); // levels move on
  }
  return { ...found, short: shortOf(asked, found.levels) };
}

/** Margins, but no more of both together than nine tenths of the tolerance: where errors are larger, the middle is aimed at. */
function room({ tolerance }, margins) {
  const both = margins[0] + margins[1], most = tolerance === null ? Infinity : 0.9 * tolerance;
  return both > most ? margins.map(margin => margin * most / both) : margins;
}

/** Levels of least power for targets moved by margins, the nearest to them where they can't be had. */
function solved(lamps, asked, moved, milliseconds) {
  const rows = asked.map((sensor, index) => ({
    row: sensor.row,
    low: sensor.target - sensor.offset + moved[index][0],
    high: sensor.tolerance === null ? Infinity : sensor.target + sensor.tolerance - sensor.offset - moved[index][1],
  }));
  const bare = rows.filter(({ row, low, high }) => {
    const most = row.reduce((sum, lux) => sum + Math.max(lux, 0), 0);
    return low > 0 || most > high || row.some(lux => lux < 0); // others hold whatever the levels
  });
  return leastPower(lamps, bare, milliseconds) ?? leastPower(lamps, bare, milliseconds, true);
}
