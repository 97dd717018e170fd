//! A map's values at the resolution of a picture, and the isolux lines through them.

use std::collections::VecDeque;

use contour::ContourBuilder;

use crate::results::IlluminanceMap;

/// Values in rows from the plane's corner; `None` where no light can arrive.
pub(super) struct Grid {
    pub(super) columns: usize,
    pub(super) rows: usize,
    values: Vec<Option<f64>>,
}

/// A line of equal illuminance, in shares (0 … 1) of the plane's extent along and across.
pub(super) struct Isolux {
    pub(super) level: f64,
    pub(super) points: Vec<[f64; 2]>,
    pub(super) closed: bool,
}

impl Grid {
    /// The map's cells; where there are more than `limit` columns or rows, means over blocks of cells that have a
    /// value.
    pub(super) fn new(map: &IlluminanceMap, limit: [usize; 2]) -> Self {
        let [columns, rows] = [0, 1].map(|i| map.cells[i].min(limit[i].max(1)));
        let block = |row, column| {
            let sources = span(row, rows, map.cells[1]).flat_map(|y| {
                let cells = span(column, columns, map.cells[0]).map(move |x| y * map.cells[0] + x);
                cells.filter_map(|cell| map.value(cell))
            });
            let (sum, count) = sources.fold((0.0, 0), |(sum, count), e| (sum + e, count + 1));
            (count > 0).then(|| sum / f64::from(count))
        };
        let values = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        Self { columns, rows, values: values.map(|(row, column)| block(row, column)).collect() }
    }

    /// Value of the cell at shares (0 … 1) of the extent.
    pub(super) fn nearest(&self, [u, v]: [f64; 2]) -> Option<f64> {
        self.values[cell(v, self.rows) * self.columns + cell(u, self.columns)]
    }

    /// Value at shares (0 … 1) of the extent, linear between the centres of cells that have a value.
    pub(super) fn between(&self, at: [f64; 2]) -> Option<f64> {
        self.nearest(at)?;
        let ([x0, x1], fx) = neighbours(at[0], self.columns);
        let ([y0, y1], fy) = neighbours(at[1], self.rows);
        let corners = [
            (x0, y0, (1.0 - fx) * (1.0 - fy)),
            (x1, y0, fx * (1.0 - fy)),
            (x0, y1, (1.0 - fx) * fy),
            (x1, y1, fx * fy),
        ];
        let known = corners.iter().filter_map(|&(x, y, w)| Some((self.values[y * self.columns + x]? * w, w)));
        let (sum, weight) = known.fold((0.0, 0.0), |(sum, weight), (e, w)| (sum + e, weight + w));
        Some(sum / weight)
    }

    /// Lines of equal illuminance at each level, none along the edge of the plane or through cells without a value. The
    /// values are first smoothed `passes` times with weights 1 : 2 : 1, against noise.
    pub(super) fn isolux(&self, levels: &[f64], passes: usize) -> Vec<Isolux> {
        let mut values = self.filled();
        if values.is_empty() {
            return Vec::new();
        }
        for _ in 0..passes {
            values = self.smoothed(&values);
        }
        // A frame of cells like those at the edge: lines then reach the edge instead of ending half a cell before it.
        let framed = self.framed(&values);
        let builder = ContourBuilder::new(self.columns + 2, self.rows + 2, true).x_origin(-1.0).y_origin(-1.0);
        let lines = builder.lines(&framed, levels).unwrap_or_default();
        let rings = lines.iter().flat_map(|line| line.geometry().0.iter().map(|ring| (line.threshold(), &ring.0)));
        let rings = rings.map(|(level, ring)| (level, ring.iter().map(|p| [p.x, p.y]).collect::<Vec<_>>()));
        rings.flat_map(|(level, ring)| self.inside(level, &ring)).collect()
    }

    /// The pieces of a closed ring (in cells) where the map really has that level.
    fn inside(&self, level: f64, ring: &[[f64; 2]]) -> Vec<Isolux> {
        let share = |p: &[f64; 2]| [p[0] / self.columns as f64, p[1] / self.rows as f64];
        let Some(gap) = ring.iter().position(|p| !self.has_line(p)) else {
            return vec![Isolux { level, points: ring.iter().map(share).collect(), closed: true }];
        };
        // The ring's last point repeats its first: leave it out, and begin where the line is interrupted.
        let open = &ring[..ring.len() - 1];
        let turned: Vec<_> = open.iter().cycle().skip(gap).take(open.len()).collect();
        let pieces = turned.split(|p| !self.has_line(p)).filter(|piece| piece.len() > 1);
        pieces.map(|piece| Isolux { level, points: piece.iter().map(|p| share(p)).collect(), closed: false }).collect()
    }

    /// Whether a line may pass a point (in cells): not outside the frame, not in a cell without a value.
    fn has_line(&self, &[x, y]: &[f64; 2]) -> bool {
        let (width, height) = (self.columns as f64, self.rows as f64);
        let inside = x > -0.9 && y > -0.9 && x < width + 0.9 && y < height + 0.9;
        inside && self.nearest([x / width, y / height]).is_some()
    }

    /// Values without gaps: each gap takes the value of a nearest cell, so that lines run up to it. Empty without
    /// values.
    fn filled(&self) -> Vec<f64> {
        let mut values = self.values.clone();
        let mut queue: VecDeque<usize> = (0..values.len()).filter(|&cell| values[cell].is_some()).collect();
        while let Some(cell) = queue.pop_front() {
            for next in self.around(cell) {
                if values[next].is_none() {
                    values[next] = values[cell];
                    queue.push_back(next);
                }
            }
        }
        values.into_iter().flatten().collect()
    }

    /// Values averaged with their neighbours, weights 1 : 2 : 1 in both directions.
    fn smoothed(&self, values: &[f64]) -> Vec<f64> {
        let average = |values: &[f64], at: usize, step: usize, i: usize, n: usize| {
            let before = if i > 0 { values[at - step] } else { values[at] };
            let after = if i + 1 < n { values[at + step] } else { values[at] };
            (before + 2.0 * values[at] + after) / 4.0
        };
        let cells = 0..values.len();
        let rows: Vec<_> =
            cells.clone().map(|cell| average(values, cell, 1, cell % self.columns, self.columns)).collect();
        cells.map(|cell| average(&rows, cell, self.columns, cell / self.columns, self.rows)).collect()
    }

    /// Values with one more cell on each side, equal to the nearest.
    fn framed(&self, values: &[f64]) -> Vec<f64> {
        let inner = |i: usize, n: usize| i.saturating_sub(1).min(n - 1);
        let rows = (0..self.rows + 2).map(|row| inner(row, self.rows) * self.columns);
        rows.flat_map(|first| (0..self.columns + 2).map(move |column| values[first + inner(column, self.columns)]))
            .collect()
    }

    /// The cells that share a side with one.
    fn around(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (x, y) = (cell % self.columns, cell / self.columns);
        let left = (x > 0).then(|| cell - 1);
        let right = (x + 1 < self.columns).then_some(cell + 1);
        let below = (y > 0).then(|| cell - self.columns);
        let above = (y + 1 < self.rows).then_some(cell + self.columns);
        [left, right, below, above].into_iter().flatten()
    }
}

/// The source cells of block `index` out of `blocks`; never empty.
fn span(index: usize, blocks: usize, cells: usize) -> std::ops::Range<usize> {
    index * cells / blocks..(index + 1) * cells / blocks
}

/// Index of the cell at a share of the extent.
fn cell(share: f64, cells: usize) -> usize {
    ((share * cells as f64) as usize).min(cells - 1)
}

/// The two cells whose centres a share lies between, and how far it is from the first to the second.
fn neighbours(share: f64, cells: usize) -> ([usize; 2], f64) {
    let at = (share * cells as f64 - 0.5).clamp(0.0, (cells - 1) as f64);
    let first = at as usize;
    ([first, (first + 1).min(cells - 1)], at - first as f64)
}
