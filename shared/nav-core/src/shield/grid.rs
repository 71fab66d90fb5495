//! A coarse map of where nothing is touched: most places of a course are told apart from the others by one bit.

/// Cells along each side.
const CELLS: usize = 64;

/// A square around the robot, in the robot frame of now. A cell without its bit touches nothing; one with it may.
pub(super) struct Grid {
    rows: [u64; CELLS],
    /// Cells whose middle discs were drawn around already.
    drawn: [u64; CELLS],
    half_m: f32,
    cells_per_m: f32,
}

impl Grid {
    /// Without a bit, reaching so far from the robot, m.
    pub(super) fn new(half_m: f32) -> Self {
        let cells_per_m = CELLS as f32 / (2.0 * half_m);
        Self { rows: [0; CELLS], drawn: [0; CELLS], half_m, cells_per_m }
    }

    /// Marks a disc. One whose centre lies in the same cell as another's before is taken for no larger than that.
    pub(super) fn draw(&mut self, (x_m, y_m): (f32, f32), radius_m: f32) {
        let (x, y) = (self.along(x_m), self.along(y_m));
        let Some((column, row)) = cell(x, y) else { return };
        if self.drawn[row] >> column & 1 == 1 {
            return;
        }
        self.drawn[row] |= 1 << column;
        // Wherever in its cells the centre and a place that is asked for lie, and the others that are left out.
        let radius = radius_m * self.cells_per_m + 3.0;
        let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
        let first = (y - radius).max(0.0) as usize;
        let last = ((y + radius) as usize).min(CELLS - 1);
        for (row, bits) in self.rows.iter_mut().enumerate().take(last + 1).skip(first) {
            let off = row as f32 + 0.5 - y;
            let reach = libm::sqrtf((radius * radius - off * off).max(0.0));
            let from = (x - reach).max(0.0) as u32;
            let to = ((x + reach) as u32).min(CELLS as u32 - 1);
            *bits |= (u64::MAX << from) & (u64::MAX >> (CELLS as u32 - 1 - to));
        }
    }

    /// Whether a place may be in one of the discs.
    pub(super) fn may_touch(&self, (x_m, y_m): (f32, f32)) -> bool {
        cell(self.along(x_m), self.along(y_m)).is_some_and(|(column, row)| self.rows[row] >> column & 1 == 1)
    }

    fn along(&self, m: f32) -> f32 {
        (m + self.half_m) * self.cells_per_m
    }
}

fn cell(x: f32, y: f32) -> Option<(usize, usize)> {
    let inside = 0.0..CELLS as f32;
    (inside.contains(&x) && inside.contains(&y)).then_some((x as usize, y as usize))
}
