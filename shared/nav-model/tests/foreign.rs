//! Models as other exporters write them: loaded when every operator is known, else named as what they are.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
}

use nav_model::load::{LoadError, LoadedNetwork, NetworkContract, load_network};
use support::models::contract;
use support::onnx::{Attribute, Dim, Graph, Message, numbers, tensor};

fn small() -> Graph {
    Graph::default().input("x", &[Dim::Fixed(1), Dim::Fixed(4)]).output("y", &[Dim::Fixed(1), Dim::Fixed(4)])
}

fn small_contract() -> NetworkContract {
    contract("x", 1, 4, "y", 1, 4)
}

fn load(graph: &Graph) -> Result<LoadedNetwork, LoadError> {
    load_network(&graph.finish(), &small_contract())
}

fn product(weights: &str) -> Graph {
    small().node("MatMul", &["x", weights], "y", &[])
}

fn answer(graph: &Graph) -> Vec<f32> {
    let mut loaded = load(graph).unwrap_or_else(|error| panic!("{error}"));
    let mut out = vec![0.0; 4];
    loaded.network_mut().run(&[0.5, -1.0, 2.0, 0.25], &mut out);
    out
}

#[test]
fn weights_that_nothing_reads_are_ignored_whatever_their_type() {
    let plain = product("w").floats("w", &[4, 4], &numbers(1, 16));
    let int32 = tensor("num_batches_tracked", &[], 6).bytes(9, &7_i32.to_le_bytes());
    let words = tensor("vocabulary", &[2], 8).text(6, "a").text(6, "b");
    let elsewhere = tensor("big", &[4, 4], 1).int(14, 1);
    let cluttered = plain.clone().tensor(int32).tensor(words).tensor(elsewhere);
    assert_eq!(answer(&cluttered), answer(&plain));
}

#[test]
fn nodes_may_share_a_name() {
    let mut graph = small().floats("w", &[4, 4], &numbers(1, 16)).floats("v", &[4, 4], &numbers(2, 16));
    let same = |input: &str, weights: &str, output: &str| {
        Message::default().text(1, input).text(1, weights).text(2, output).text(3, "Gemm").text(4, "Gemm")
    };
    graph.body = graph.body.message(1, &same("x", "w", "middle")).message(1, &same("middle", "v", "y"));
    assert!(load(&graph).is_ok(), "{:?}", load(&graph).err());
}

#[test]
fn every_operator_set_from_9_to_24_is_read() {
    for operator_set in 9..=24 {
        let mut graph = small()
            .floats("w", &[4, 4], &numbers(1, 16))
            .floats("b", &[4], &numbers(2, 4))
            .node("Gemm", &["x", "w", "b"], "g", &[Attribute::Int("transB", 1)])
            .node("Relu", &["g"], "r", &[])
            .node("Tanh", &["r"], "y", &[]);
        graph.operator_set = operator_set;
        assert!(load(&graph).is_ok(), "operator set {operator_set}: {:?}", load(&graph).err());
    }
}

#[test]
fn constants_may_be_prepared_by_nodes() {
    let numbers = numbers(1, 16);
    let plain = product("w").floats("w", &[4, 4], &numbers);
    let transposed: Vec<f32> = (0..16).map(|at| numbers[at % 4 * 4 + at / 4]).collect();
    let turned = small().floats("t", &[4, 4], &transposed).node("Transpose", &["t"], "w", &[]);
    assert_eq!(answer(&turned.node("MatMul", &["x", "w"], "y", &[])), answer(&plain));
    let halves: Vec<f32> = numbers.iter().map(|number| 0.5 * number).collect();
    let added = small().floats("h", &[4, 4], &halves).node("Add", &["h", "h"], "w", &[]);
    assert_eq!(answer(&added.node("MatMul", &["x", "w"], "y", &[])), answer(&plain));
    let wide: Vec<u8> = numbers.iter().flat_map(|number| f64::from(*number).to_le_bytes()).collect();
    let cast = small().tensor(tensor("d", &[4, 4], 11).bytes(9, &wide)).node(
        "Cast",
        &["d"],
        "w",
        &[Attribute::Int("to", 1)],
    );
    assert_eq!(answer(&cast.node("MatMul", &["x", "w"], "y", &[])), answer(&plain));
}

#[test]
fn half_precision_weights_behind_a_cast_are_read() {
    // 1, 0.5, -2 and 0.25 in 16 bits.
    let halves = [0x3C00_u16, 0x3800, 0xC000, 0x3400].repeat(4);
    let raw: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
    let graph = small()
        .tensor(tensor("h", &[4, 4], 10).bytes(9, &raw))
        .node("Cast", &["h"], "w", &[Attribute::Int("to", 1)])
        .node("MatMul", &["x", "w"], "y", &[]);
    let plain = product("w").floats("w", &[4, 4], &[1.0, 0.5, -2.0, 0.25].repeat(4));
    assert_eq!(answer(&graph), answer(&plain));
}

/// What is not read is called what it is, never damaged or diverged.
#[test]
fn what_is_not_read_is_named() {
    let raw = |bytes: usize| vec![0; bytes];
    let outside = tensor("w", &[4, 4], 1).int(14, 1);
    let quantised = tensor("w", &[4, 4], 3).bytes(9, &raw(16));
    let unknown = tensor("w", &[4, 4], 9999).bytes(9, &raw(64));
    let half = tensor("w", &[4, 4], 10).bytes(9, &raw(32));
    for (weights, parts) in [
        (outside, ["another file", "external_data=False"]),
        (quantised, ["type Int8", "32-bit floats"]),
        (unknown, ["type 9999", "32-bit floats"]),
        (half, ["type Float16", "32-bit floats"]),
    ] {
        let error = load(&product("w").tensor(weights)).map(|_| ()).expect_err(parts[0]).to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{parts:?} in {error}");
        assert!(!error.contains("damaged") && !error.contains("diverged"), "{error}");
    }
}
