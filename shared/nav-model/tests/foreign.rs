//! Models as other exporters write them: loaded when every operator is known, else named as what they are.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
}

use nav_model::load::{DataFile, LoadError, LoadedNetwork, NetworkContract, load_network, load_network_with};
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

/// 1, 0.5, -2 and 0.25, four times over, in 16 bits.
const HALVES: [u16; 4] = [0x3C00, 0x3800, 0xC000, 0x3400];

fn of_halves() -> Vec<f32> {
    [1.0, 0.5, -2.0, 0.25].repeat(4)
}

/// As converters write it that keep 32-bit inputs and outputs: everything between two casts computes in 16 bits.
#[test]
fn half_precision_weights_that_nothing_casts_are_read() {
    let plain = answer(&product("w").floats("w", &[4, 4], &of_halves()));
    let raw: Vec<u8> = HALVES.repeat(4).iter().flat_map(|half| half.to_le_bytes()).collect();
    let typed = |data_type| {
        HALVES.repeat(4).iter().fold(tensor("w", &[4, 4], data_type), |tensor, half| {
            let bits =
                if data_type == 10 { i64::from(*half) } else { i64::from(of_half(*half).to_bits() >> 16) };
            tensor.int(5, bits)
        })
    };
    let brain: Vec<u8> =
        of_halves().iter().flat_map(|number| (number.to_bits() >> 16).to_le_bytes()[..2].to_vec()).collect();
    let wide: Vec<u8> = of_halves().iter().flat_map(|number| f64::from(*number).to_le_bytes()).collect();
    for (weights, kind) in [
        (tensor("w", &[4, 4], 10).bytes(9, &raw), 10),
        (typed(10), 10),
        (tensor("w", &[4, 4], 16).bytes(9, &brain), 16),
        (typed(16), 16),
        (tensor("w", &[4, 4], 11).bytes(9, &wide), 11),
    ] {
        let graph = small()
            .node("Cast", &["x"], "narrow", &[Attribute::Int("to", kind)])
            .tensor(weights)
            .node("MatMul", &["narrow", "w"], "product", &[])
            .node("Cast", &["product"], "y", &[Attribute::Int("to", 1)]);
        assert_eq!(answer(&graph), plain, "type {kind}");
    }
}

fn of_half(half: u16) -> f32 {
    let at = HALVES.iter().position(|known| *known == half).unwrap();
    of_halves()[at]
}

/// As `model.half()` and an export write it.
#[test]
fn a_graph_of_nothing_but_16_bit_floats_is_read() {
    let raw: Vec<u8> = HALVES.repeat(4).iter().flat_map(|half| half.to_le_bytes()).collect();
    let graph = |inside: i64, outside: i64| {
        Graph::default()
            .port_of(11, outside, "x", &[Dim::Fixed(1), Dim::Fixed(4)])
            .port_of(12, outside, "y", &[Dim::Fixed(1), Dim::Fixed(4)])
            .tensor(tensor("w", &[4, 4], inside).bytes(9, &raw))
            .node("MatMul", &["x", "w"], "y", &[])
    };
    assert_eq!(answer(&graph(10, 10)), answer(&product("w").floats("w", &[4, 4], &of_halves())));
    // Integers are none.
    let error = load(&graph(10, 7)).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("not of 32-bit floats"), "{error}");
}

#[test]
fn a_cast_of_what_is_computed_to_anything_but_floats_is_refused() {
    let graph = product("w").floats("w", &[4, 4], &numbers(1, 16));
    let rounded = small()
        .floats("w", &[4, 4], &numbers(1, 16))
        .node("Cast", &["x"], "whole", &[Attribute::Int("to", 7)])
        .node("Cast", &["whole"], "x2", &[Attribute::Int("to", 1)])
        .node("MatMul", &["x2", "w"], "y", &[]);
    assert!(load(&graph).is_ok());
    assert!(matches!(load(&rounded), Err(LoadError::Operator { operator, .. }) if operator == "Cast"));
}

#[test]
fn damaged_weights_of_other_widths_are_refused() {
    let raw = |halves: &[u16]| halves.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<u8>>();
    let mut infinite = HALVES.repeat(4);
    infinite[7] = 0x7C00;
    let mut odd = raw(&HALVES.repeat(4));
    odd.push(0);
    let typed = HALVES
        .repeat(4)
        .iter()
        .fold(tensor("w", &[4, 4], 10), |tensor, half| tensor.int(5, i64::from(*half)));
    let negative = (0..16).fold(tensor("w", &[4, 4], 10), |tensor, _| tensor.int(5, -1));
    let huge: Vec<u8> = [1e300_f64; 16].iter().flat_map(|number| number.to_le_bytes()).collect();
    for (index, weights) in [
        tensor("w", &[4, 4], 10).bytes(9, &raw(&infinite)),
        tensor("w", &[4, 4], 10).bytes(9, &odd),
        tensor("w", &[4, 4], 10).bytes(9, &raw(&HALVES)),
        typed.bytes(9, &raw(&HALVES.repeat(4))),
        negative,
        tensor("w", &[4, 4], 11).bytes(9, &huge),
    ]
    .into_iter()
    .enumerate()
    {
        let error = load(&product("w").tensor(weights)).map(|_| ()).expect_err("damaged");
        assert!(
            matches!(error, LoadError::Weights { .. } | LoadError::WeightType { .. }),
            "{index}: {error}"
        );
    }
}

/// A tensor whose data lies in a file, with these entries.
fn outside(entries: &[(&str, &str)]) -> Message {
    let entry = |(key, value): &(&str, &str)| Message::default().text(1, key).text(2, value);
    entries.iter().fold(tensor("w", &[4, 4], 1), |tensor, said| tensor.message(13, &entry(said))).int(14, 1)
}

fn load_beside(weights: Message, files: &[(&str, &[u8])]) -> Result<LoadedNetwork, LoadError> {
    let files: Vec<_> = files.iter().map(|(name, bytes)| DataFile { name, bytes }).collect();
    load_network_with(&product("w").tensor(weights).finish(), &files, &small_contract())
}

#[test]
fn weights_in_files_beside_the_model_are_read() {
    let numbers = numbers(1, 16);
    let plain = answer(&product("w").floats("w", &[4, 4], &numbers));
    let raw: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let later = [&[7; 48], raw.as_slice(), &[9; 5]].concat();
    let files: [(&str, &[u8]); 3] = [("other", &[1]), ("model.onnx.data", &raw), ("late", &later)];
    for entries in [
        &[("location", "model.onnx.data"), ("offset", "0"), ("length", "64")][..],
        &[("location", "model.onnx.data")],
        &[("length", "64"), ("checksum", "of whatever"), ("offset", "48"), ("location", "late")],
        // Without a length, as much as the shape says, and not all that follows.
        &[("location", "late"), ("offset", "48")],
    ] {
        let mut loaded = load_beside(outside(entries), &files).unwrap_or_else(|error| panic!("{error}"));
        let mut out = vec![0.0; 4];
        loaded.network_mut().run(&[0.5, -1.0, 2.0, 0.25], &mut out);
        assert_eq!(out, plain, "{entries:?}");
        // Another engine gets the whole model.
        assert!(load_network(loaded.onnx(), &small_contract()).is_ok(), "{entries:?}");
    }
}

#[test]
fn weights_that_their_file_does_not_hold_are_named() {
    let raw = [0; 64];
    let files: [(&str, &[u8]); 1] = [("data", &raw)];
    let at = |offset: &'static str, length: &'static str| {
        outside(&[("location", "data"), ("offset", offset), ("length", length)])
    };
    let largest = usize::MAX.to_string();
    let largest: &'static str = Box::leak(largest.into_boxed_str());
    for (weights, part) in [
        (at("1", "64"), "it has only 64"),
        (at("64", "64"), "it has only 64"),
        (at(largest, "64"), "it has only 64"),
        (at("64", largest), "it has only 64"),
        (at(largest, largest), "it has only 64"),
        (at("-1", "64"), "the offset `-1`, which is no number"),
        (at("0", "1e3"), "the length `1e3`, which is no number"),
        (at("99999999999999999999999", "64"), "which is no number"),
        (at("0", "60"), "hold other data than their shape"),
        (outside(&[("location", "data"), ("offset", "4")]), "it has only 64"),
        (outside(&[("location", "/etc/passwd")]), "`/etc/passwd`, which the manifest does not list"),
        (outside(&[("location", "../data")]), "`../data`, which the manifest does not list"),
        (outside(&[("offset", "0")]), "which the manifest does not list"),
        (outside(&[]), "which the manifest does not list"),
        (outside(&[("location", "data"), ("location", "data")]), "the location is said twice"),
        (outside(&[("location", "data"), ("offset", "0"), ("offset", "4")]), "the offset is said twice"),
        (outside(&[("location", "data")]).bytes(9, &raw), "also in the model"),
        (tensor("w", &[4, 4], 1).int(14, 2), "also in the model"),
        (
            tensor("w", &[4, 4], 1).int(14, 0).message(13, &Message::default().text(1, "location")),
            "also in the model",
        ),
    ] {
        let error = load_beside(weights, &files).map(|_| ()).expect_err(part).to_string();
        assert!(error.contains("`w`") && error.contains(part), "{part} in {error}");
        assert!(!error.contains("diverged") || part.contains("shape"), "{error}");
    }
}

/// Many tensors of one file: small models that would need much memory.
#[test]
fn weights_of_files_are_bounded_in_total() {
    let file = vec![0; 1 << 20];
    let graph = (0..16).fold(small(), |graph, index| {
        let name = format!("w{index}");
        let entry = Message::default().text(1, "location").text(2, "data");
        let graph = graph.tensor(tensor(&name, &[512, 512], 1).message(13, &entry).int(14, 1));
        graph.node("Identity", &[&name], &format!("same{index}"), &[])
    });
    let files = [DataFile { name: "data", bytes: &file }];
    let error = load_network_with(&graph.finish(), &files, &small_contract()).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("together come to more than 8388608 bytes"), "{error}");
}

/// What is not read is called what it is, never damaged or diverged.
#[test]
fn what_is_not_read_is_named() {
    let raw = |bytes: usize| vec![0; bytes];
    let elsewhere = outside(&[("location", "model.onnx.data")]);
    let quantised = tensor("w", &[4, 4], 3).bytes(9, &raw(16));
    let unknown = tensor("w", &[4, 4], 9999).bytes(9, &raw(64));
    for (weights, parts) in [
        (elsewhere, ["another file, `model.onnx.data`", "external_data=False"]),
        (quantised, ["type Int8", "32-bit floats"]),
        (unknown, ["type 9999", "32-bit floats"]),
    ] {
        let error = load(&product("w").tensor(weights)).map(|_| ()).expect_err(parts[0]).to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{parts:?} in {error}");
        assert!(!error.contains("damaged") && !error.contains("diverged"), "{error}");
    }
}
