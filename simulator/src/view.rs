//! A map in the terminal, redrawn in place: two by four dots a character.

use nav_core::geometry::Point;
use nav_core::messages::CmdVel;
use nav_sim::simulation::Simulation;
use nav_sim::world::Bounds;
use std::io::Write;
use std::time::{Duration, Instant};

/// Width of the map, characters; the height follows the world's shape.
const COLUMNS: usize = 56;
/// The tallest map, lines.
const ROWS_MAX: usize = 34;
/// Pictures come no faster than this.
const FRAME: Duration = Duration::from_millis(100);

/// The picture of an episode: what does not move is drawn once.
#[derive(Debug, Default)]
pub(crate) struct View {
    canvas: Canvas,
    walls: Vec<u8>,
    trail: Vec<Point>,
    drawn_lines: usize,
    last_frame: Option<Instant>,
}

#[derive(Debug, Default)]
struct Canvas {
    min: Point,
    dot_m: f32,
    rows: usize,
    dots: Vec<u8>,
    marks: Vec<Option<char>>,
}

impl Canvas {
    fn over(bounds: &Bounds) -> Self {
        let size = bounds.max - bounds.min;
        let dot_m = (size.x / (2 * COLUMNS) as f32).max(size.y / (4 * ROWS_MAX) as f32).max(1e-3);
        let rows = ((size.y / dot_m / 4.0).ceil() as usize).clamp(1, ROWS_MAX);
        Self {
            min: bounds.min,
            dot_m,
            rows,
            dots: vec![0; COLUMNS * rows],
            marks: vec![None; COLUMNS * rows],
        }
    }

    /// Character and bit of a point, if it lies on the canvas.
    fn locate(&self, point: Point) -> Option<(usize, u8)> {
        let offset = (point - self.min) / self.dot_m;
        if offset.x < 0.0 || offset.y < 0.0 {
            return None;
        }
        let (x, y) = (offset.x as usize, offset.y as usize);
        if x >= 2 * COLUMNS || y >= 4 * self.rows {
            return None;
        }
        let y = 4 * self.rows - 1 - y;
        // Unicode braille: dots 1-3 and 7 on the left, 4-6 and 8 on the right.
        let bit = [[0, 3], [1, 4], [2, 5], [6, 7]][y % 4][x % 2];
        Some((y / 4 * COLUMNS + x / 2, 1 << bit))
    }

    fn dot(&mut self, point: Point) {
        if let Some((cell, bit)) = self.locate(point) {
            self.dots[cell] |= bit;
        }
    }

    fn mark(&mut self, point: Point, symbol: char) {
        if let Some((cell, _)) = self.locate(point) {
            self.marks[cell] = Some(symbol);
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for row in 0..self.rows {
            for cell in row * COLUMNS..(row + 1) * COLUMNS {
                let braille = char::from_u32(0x2800 + u32::from(self.dots[cell])).unwrap_or(' ');
                text.push(self.marks[cell].unwrap_or(braille));
            }
            text.push_str("\x1b[K\n");
        }
        text
    }
}

impl View {
    /// A new world: its walls are found once.
    pub(crate) fn begin(&mut self, simulation: &Simulation) {
        self.canvas = Canvas::over(&simulation.world().bounds);
        let dot_m = self.canvas.dot_m;
        for y in 0..4 * self.canvas.rows {
            for x in 0..2 * COLUMNS {
                let point = Point::new(
                    self.canvas.min.x + (x as f32 + 0.5) * dot_m,
                    self.canvas.min.y + (y as f32 + 0.5) * dot_m,
                );
                // Half a dot's diagonal: no thin wall slips between the centres.
                if simulation.obstacles().collides(point, 0.75 * dot_m) {
                    self.canvas.dot(point);
                }
            }
        }
        self.walls = self.canvas.dots.clone();
        self.trail.clear();
        self.last_frame = None;
    }

    /// Draws the present moment over the last picture, if it is time for one or the episode is over.
    pub(crate) fn show(&mut self, simulation: &Simulation, command: &CmdVel, over: bool) {
        self.trail.push(simulation.pose().position());
        if !over && self.last_frame.is_some_and(|last| last.elapsed() < FRAME) {
            return;
        }
        self.last_frame = Some(Instant::now());
        let picture = self.picture(simulation, command);
        let mut out = std::io::stdout().lock();
        if self.drawn_lines > 0 {
            // Back to the first line of the last picture. A terminal that is gone is no reason to stop driving.
            let _ = write!(out, "\x1b[{}A", self.drawn_lines);
        }
        let _ = out.write_all(picture.as_bytes());
        let _ = out.flush();
        self.drawn_lines = if over { 0 } else { picture.matches('\n').count() };
    }

    fn picture(&mut self, simulation: &Simulation, command: &CmdVel) -> String {
        self.canvas.dots.clone_from(&self.walls);
        self.canvas.marks.fill(None);
        for point in &self.trail {
            self.canvas.dot(*point);
        }
        self.canvas.mark(simulation.world().goal, 'X');
        for person in simulation.people() {
            self.canvas.mark(person.position, 'o');
        }
        let pose = simulation.pose();
        self.canvas.mark(pose.position(), arrow(pose.yaw_rad));
        let to_goal_m = (simulation.world().goal - pose.position()).norm();
        format!(
            "{}{}  {:5.1} s  goal {to_goal_m:.1} m  v {:.2} m/s  w {:+.2} rad/s  faults {:#x}\x1b[K\n",
            self.canvas.text(),
            simulation.world().name,
            simulation.time_s(),
            command.linear_mps,
            command.angular_radps,
            command.faults
        )
    }
}

fn arrow(yaw_rad: f32) -> char {
    let eighths = (yaw_rad / std::f32::consts::FRAC_PI_4).round() as i32;
    ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'][eighths.rem_euclid(8) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::task::Task;
    use nav_sim::disturbance::Disturbance;
    use nav_sim::families::{Family, Split, generate};
    use std::sync::Arc;

    #[test]
    fn the_picture_shows_walls_robot_and_goal() {
        // Thin walls on round numbers, which lie exactly between two dots.
        let world = Arc::new(generate(Family::Maze, Split::Test, 1));
        let simulation = Simulation::new(world, &Task::default(), &Disturbance::none(), 1);
        let mut view = View::default();
        view.begin(&simulation);
        let picture = view.picture(&simulation, &CmdVel::default());
        assert!(picture.contains('X'), "{picture}");
        assert!(picture.chars().any(|c| "→↗↑↖←↙↓↘".contains(c)), "{picture}");
        let dots = picture.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
        assert!(dots > 200, "walls are drawn: {picture}");
    }

    #[test]
    fn up_is_up_and_left_is_left() {
        let bounds = Bounds { min: Point::new(0.0, 0.0), max: Point::new(14.0, 14.0) };
        let canvas = Canvas::over(&bounds);
        let cell = |x, y| canvas.locate(Point::new(x, y)).map(|(cell, _)| (cell / COLUMNS, cell % COLUMNS));
        assert_eq!(cell(0.01, 13.99), Some((0, 0)));
        assert_eq!(cell(13.99, 0.01), Some((canvas.rows - 1, COLUMNS - 1)));
        assert_eq!(cell(-0.1, 1.0), None);
        assert_eq!([0.0, 1.6, 3.1, -1.6].map(arrow), ['→', '↑', '←', '↓']);
    }
}
