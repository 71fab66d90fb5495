//! The runtime's side of the topics, with the newest message of each.

use nav_core::messages::{CmdVel, Goal, LaserScan, Odometry, Status};
use nav_core::tick::Inputs;
use nav_host::terminal::warn;
use nav_ipc::others::programs_of_other_users;
use nav_ipc::{IpcConfig, IpcError, Reader, RobotName, RobotNode, Wakeup, Writer};
use std::time::Duration;

/// The topics that a run reads and writes. Stays in the thread that opened it.
#[derive(Debug)]
pub struct Ports {
    scan_in: Reader<LaserScan>,
    odom_in: Reader<Odometry>,
    goal_in: Reader<Goal>,
    command_out: Writer<CmdVel>,
    status_out: Writer<Status>,
    wakeup: Wakeup,
    scan: Box<LaserScan>,
    odom: Odometry,
    goal: Goal,
    // Last: ports go before their node.
    _node: RobotNode,
}

impl Ports {
    /// Opens all topics. The command topic first: a second runtime is refused before it could disturb anything. Says so when
    /// other users have topics open that this one cannot see.
    ///
    /// # Errors
    /// See [`RobotNode`].
    pub fn open(robot: &RobotName, config: &IpcConfig) -> Result<Self, IpcError> {
        let node = RobotNode::open(robot, config)?;
        if let Some(word) = programs_of_other_users(config) {
            warn(word);
        }
        let command_out = node.writer()?;
        Ok(Self {
            command_out,
            status_out: node.writer()?,
            wakeup: node.wakeup::<LaserScan>()?,
            goal_in: node.reader()?,
            odom_in: node.reader()?,
            // The last reader: a simulator that sees it finds all the others.
            scan_in: node.reader()?,
            scan: Box::default(),
            odom: Odometry::default(),
            goal: Goal::default(),
            _node: node,
        })
    }

    /// Connects to peers that joined and forgets those that left. Allocates when there are any.
    ///
    /// # Errors
    /// [`IpcError`]: shared memory is broken or exhausted, or a topic has more than one writer.
    pub fn refresh(&self) -> Result<(), IpcError> {
        self.scan_in.refresh()?;
        self.odom_in.refresh()?;
        self.goal_in.refresh()?;
        self.command_out.refresh()?;
        self.status_out.refresh()
    }

    /// Takes the newest message of each topic; true when the scan is another one than before.
    ///
    /// # Errors
    /// [`IpcError`]: shared memory is broken.
    pub fn read(&mut self) -> Result<bool, IpcError> {
        let before = self.scan.header;
        // The scan first: whoever publishes a set writes it last, so that what is read next is not older.
        self.scan_in.read_latest(&mut self.scan)?;
        self.odom_in.read_latest(&mut self.odom)?;
        self.goal_in.read_latest(&mut self.goal)?;
        Ok(self.scan.header != before)
    }

    /// The newest messages.
    pub fn inputs(&self) -> Inputs<'_> {
        Inputs { scan: &self.scan, odom: &self.odom, goal: &self.goal }
    }

    /// Waits for a scan, at most `timeout`.
    ///
    /// # Errors
    /// [`IpcError::Wait`].
    pub fn wait(&self, timeout: Duration) -> Result<bool, IpcError> {
        self.wakeup.wait(timeout)
    }

    /// Waits for a scan until a time of [`nav_ipc::clock`].
    ///
    /// # Errors
    /// [`IpcError::Wait`].
    pub fn wait_until(&self, deadline_ns: u64) -> Result<bool, IpcError> {
        self.wakeup.wait_until(deadline_ns)
    }

    /// Publishes a command.
    ///
    /// # Errors
    /// [`IpcError::Send`].
    pub fn command(&self, command: &CmdVel) -> Result<(), IpcError> {
        self.command_out.write(command)
    }

    /// Publishes what the runtime does.
    ///
    /// # Errors
    /// [`IpcError::Send`].
    pub fn status(&self, status: &Status) -> Result<(), IpcError> {
        self.status_out.write(status)
    }

    /// Whether anybody writes scans, the killed included until their leftovers are removed.
    pub fn has_scan_writer(&self) -> bool {
        self.scan_in.writer_count() > 0
    }
}
