//! Programs that use iceoryx2's own service variant talk with ours, both ways, whoever comes first.

#[path = "../../nav-model/tests/support/soak.rs"]
mod soak;

use iceoryx2::prelude::{NodeBuilder, ServiceName, ZeroCopySend, ipc};
use nav_core::messages::{CmdVel, Header};
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode};
use std::time::Duration;

/// A command as another program declares it: the same bytes under the same name.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("hybridnav/CmdVel/v1")]
#[repr(C)]
struct TheirCommand {
    stamp_ns: u64,
    seq: u64,
    linear_mps: f32,
    angular_radps: f32,
    scan_seq: u64,
    faults: u32,
    state: u32,
}

#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("hybridnav/CmdVel/v0")]
#[repr(C)]
struct OldCommand([u64; 5]);

struct Stage {
    config: IpcConfig,
    robot: RobotName,
    _folder: tempfile::TempDir,
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.config.remove_all();
    }
}

fn stage() -> Stage {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let config = IpcConfig::in_folder(folder.path()).expect("a short path");
    Stage { config, robot: RobotName::new("r").expect("a plain name"), _folder: folder }
}

fn service_name() -> ServiceName {
    ServiceName::new("hybridnav/r/cmd_vel").expect("a service name")
}

#[test]
fn our_writer_reaches_a_stock_reader_that_came_first() {
    let stage = stage();
    let config = stage.config.iceoryx2().expect("a configuration");
    let their_node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let service = their_node
        .service_builder(&service_name())
        .publish_subscribe::<TheirCommand>()
        .max_publishers(1)
        .open_or_create()
        .expect("their service");
    let subscriber = service.subscriber_builder().create().expect("their reader");
    let event = their_node.service_builder(&service_name()).event().open_or_create().expect("their event");
    let listener = event.listener_builder().create().expect("their listener");

    let node = RobotNode::open(&stage.robot, &stage.config).expect("our node");
    let writer = node.writer::<CmdVel>().expect("our writer");
    let sent =
        CmdVel { header: Header { stamp_ns: 5, seq: 9 }, linear_mps: 0.5, scan_seq: 8, ..CmdVel::default() };
    writer.write(&sent).expect("sent");

    let woken = listener.timed_wait(|_| {}, Duration::from_secs(5)).expect("waited");
    assert_eq!(woken, 1);
    let sample = subscriber.receive().expect("received").expect("a message");
    assert_eq!((sample.stamp_ns, sample.seq, sample.scan_seq), (5, 9, 8));
    assert_eq!(sample.linear_mps.to_bits(), 0.5_f32.to_bits());
}

#[test]
fn a_stock_writer_reaches_our_reader_that_came_first() {
    let stage = stage();
    let node = RobotNode::open(&stage.robot, &stage.config).expect("our node");
    let reader = node.reader::<CmdVel>().expect("our reader");
    let wakeup = node.wakeup::<CmdVel>().expect("our wakeup");

    let config = stage.config.iceoryx2().expect("a configuration");
    let their_node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let service = their_node
        .service_builder(&service_name())
        .publish_subscribe::<TheirCommand>()
        .open_or_create()
        .expect("our service, opened");
    let publisher = service.publisher_builder().create().expect("their writer");
    let event = their_node.service_builder(&service_name()).event().open_or_create().expect("our event");
    let notifier = event.notifier_builder().create().expect("their notifier");
    for seq in 1..=5 {
        let command = TheirCommand {
            stamp_ns: 0,
            seq,
            linear_mps: 0.0,
            angular_radps: -1.0,
            scan_seq: 0,
            faults: 0,
            state: 0,
        };
        publisher.send_copy(command).expect("sent");
    }
    notifier.notify().expect("notified");

    assert!(wakeup.wait(Duration::from_secs(5)).expect("waited"));
    let mut command = CmdVel::default();
    assert!(reader.read_latest(&mut command).expect("received"));
    assert_eq!(command.header.seq, 5, "the newest of five");
    assert!(node.writer::<CmdVel>().is_err(), "a stock writer counts as the one writer");
}

/// iceoryx2's default is two writers: a reader that was started first would open the topic to anybody.
#[test]
fn a_topic_that_others_could_write_too_is_refused_with_who_opened_it() {
    let stage = stage();
    let config = stage.config.iceoryx2().expect("a configuration");
    let their_node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let service = their_node
        .service_builder(&service_name())
        .publish_subscribe::<TheirCommand>()
        .open_or_create()
        .expect("their service");
    let _subscriber = service.subscriber_builder().create().expect("their reader");

    let node = RobotNode::open(&stage.robot, &stage.config).expect("our node");
    let process = format!("process {}", std::process::id());
    for error in [
        node.writer::<CmdVel>().map(drop).expect_err("a writer"),
        node.reader::<CmdVel>().map(drop).expect_err("a reader"),
    ] {
        assert!(matches!(error, IpcError::SeveralWritersAllowed { writers_max: 2, .. }), "{error}");
        let error = error.to_string();
        assert!(error.contains(&process) && error.contains("max_publishers(1)"), "{error}");
    }
    soak::count(&[("topics that others could write refused", 2)]);
    drop((service, _subscriber, their_node));
    assert!(node.writer::<CmdVel>().is_ok(), "once they are gone it is ours");
}

#[test]
fn nobody_can_be_a_second_writer_of_a_topic_that_we_opened() {
    let stage = stage();
    let node = RobotNode::open(&stage.robot, &stage.config).expect("our node");
    let _writer = node.writer::<CmdVel>().expect("our writer");
    let config = stage.config.iceoryx2().expect("a configuration");
    let their_node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let builder = || their_node.service_builder(&service_name()).publish_subscribe::<TheirCommand>();
    let service = builder().open_or_create().expect("our service, opened");
    assert!(service.publisher_builder().create().is_err(), "the place is taken");
    assert!(builder().max_publishers(2).open_or_create().is_err(), "nor can there be more places");
    soak::count(&[("second writers kept out", 2)]);
}

#[test]
fn another_version_of_a_type_is_refused() {
    let stage = stage();
    let config = stage.config.iceoryx2().expect("a configuration");
    let their_node = NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let _service = their_node
        .service_builder(&service_name())
        .publish_subscribe::<OldCommand>()
        .open_or_create()
        .expect("their service");
    let node = RobotNode::open(&stage.robot, &stage.config).expect("our node");
    let error = node.reader::<CmdVel>().expect_err("another type").to_string();
    assert!(error.contains("run programs of the same version"), "{error}");
}
