//! Models that trainers write are loaded; each kind of damage is refused with its own words, never a panic.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
}

use nav_core::network::CpuLevel;
use nav_model::load::{LoadError, MAX_MODEL_BYTES, NetworkContract, load_network, load_network_at};
use support::models::{self, contract};
use support::onnx::{Attribute, Dim, Graph, Message, numbers, tensor};

#[test]
fn every_model_loads_and_agrees_with_tract_on_every_level() {
    for (name, bytes, contract) in models::all() {
        for level in [CpuLevel::Portable, CpuLevel::detect()] {
            let loaded =
                load_network_at(&bytes, &contract, level).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(loaded.parity() <= 1e-5, "{name} at {level}: {}", loaded.parity());
            assert_eq!(loaded.network().input_shape(), [contract.input.rows, contract.input.cols], "{name}");
            assert_eq!(loaded.network().output_len(), contract.output.elements(), "{name}");
        }
    }
}

/// A check that does not rest on tract: one layer by hand.
#[test]
fn a_loaded_layer_matches_its_definition() {
    let (weights, bias) = (numbers(1, 6), numbers(2, 2));
    let graph = Graph::default()
        .input("x", &[Dim::Fixed(1), Dim::Fixed(3)])
        .floats("w", &[2, 3], &weights)
        .floats("b", &[2], &bias)
        .node("Gemm", &["x", "w", "b"], "g", &[Attribute::Int("transB", 1)])
        .node("Tanh", &["g"], "y", &[])
        .output("y", &[Dim::Fixed(1), Dim::Fixed(2)]);
    let mut loaded = load_network(&graph.finish(), &contract("x", 1, 3, "y", 1, 2)).unwrap();
    let (x, mut y) = ([0.3, -0.7, 2.0], [0.0; 2]);
    loaded.network_mut().run(&x, &mut y);
    for (output, found) in y.iter().enumerate() {
        let sum: f32 = (0..3).map(|input| weights[output * 3 + input] * x[input]).sum();
        assert!((found - (sum + bias[output]).tanh()).abs() < 1e-6);
    }
    assert_eq!(loaded.network().step_count(), 1, "bias and activation are taken into the product");
}

#[test]
fn products_take_their_bias_and_activation_along() {
    let steps =
        |(_, bytes, contract): models::Model| load_network(&bytes, &contract).unwrap().network().step_count();
    assert_eq!(steps(models::actor()), 2 + 3 + 2);
    assert_eq!(steps(models::scorer()), 1 + 3);
}

fn small() -> Graph {
    Graph::default()
        .input("x", &[Dim::Fixed(1), Dim::Fixed(4)])
        .output("y", &[Dim::Fixed(1), Dim::Fixed(4)])
        .floats("w", &[4, 4], &numbers(1, 16))
}

fn small_contract() -> NetworkContract {
    contract("x", 1, 4, "y", 1, 4)
}

fn refused(graph: &Graph) -> LoadError {
    load_network(&graph.finish(), &small_contract()).map(|_| ()).unwrap_err()
}

#[test]
fn unknown_operators_are_named_with_their_node() {
    let error = refused(&small().node("Softmax", &["x"], "y", &[]));
    assert_eq!(
        error.to_string(),
        "node `make y` uses the operator Softmax, which this runtime does not run; export the policy with the operators \
         in the documentation"
    );
    // Allowed by name, but in a form that the executor has no step for.
    let cube = small().floats("three", &[], &[3.5]).node("Pow", &["x", "three"], "y", &[]);
    assert!(matches!(refused(&cube), LoadError::Lowering { node, .. } if node == "make y"));
    let product = small()
        .ints("shape", &[4, 1])
        .node("Reshape", &["x", "shape"], "column", &[])
        .node("MatMul", &["column", "x"], "square", &[])
        .node("ReduceSum", &["square"], "y", &[Attribute::Int("keepdims", 0)]);
    let refused_product = refused(&product);
    assert!(matches!(refused_product, LoadError::Lowering { .. }), "{refused_product}");
}

#[test]
fn damaged_weights_are_refused() {
    let with = |w: Message| {
        let graph = Graph::default()
            .input("x", &[Dim::Fixed(1), Dim::Fixed(4)])
            .output("y", &[Dim::Fixed(1), Dim::Fixed(4)])
            .tensor(w)
            .node("MatMul", &["x", "w"], "y", &[]);
        refused(&graph)
    };
    let data = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>();
    for bad in [f32::NAN, f32::INFINITY, 1e7] {
        let mut values = numbers(1, 16);
        values[11] = bad;
        let error = with(tensor("w", &[4, 4], 1).bytes(9, &data(&values)));
        assert!(error.to_string().contains(&format!("contain {bad}")), "{error}");
        // The same in the typed field instead of raw bytes.
        let typed = values.iter().fold(tensor("w", &[4, 4], 1), |tensor, value| tensor.float(4, *value));
        assert!(matches!(with(typed), LoadError::Weights { .. }));
    }
    let good = data(&numbers(1, 16));
    let wrong = [
        tensor("w", &[4, 5], 1).bytes(9, &good),
        tensor("w", &[-4, -4], 1).bytes(9, &good),
        tensor("w", &[i64::MAX, i64::MAX], 1).bytes(9, &good),
        tensor("w", &[1 << 32, 1 << 32, 1 << 32], 1).bytes(9, &good),
        tensor("w", &[0, 4], 1),
        tensor("w", &[2, 2, 2, 2, 1], 1).bytes(9, &good),
        tensor("w", &[4, 4], 1),
        tensor("w", &[4, 4], 11).bytes(9, &good),
        tensor("w", &[4, 4], 1).bytes(9, &good).message(3, &Message::default().int(1, 0)),
        tensor("w", &[4, 4], 1).bytes(9, &good).float(4, 1.0),
    ];
    for (index, tensor) in wrong.into_iter().enumerate() {
        let error = with(tensor);
        assert!(matches!(error, LoadError::Weights { .. }), "case {index}: {error}");
    }
}

#[test]
fn names_and_shapes_must_be_exactly_those_of_the_contract() {
    let graph = small().node("MatMul", &["x", "w"], "y", &[]).finish();
    assert!(load_network(&graph, &small_contract()).is_ok());
    let wrong = [
        contract("observation", 1, 4, "y", 1, 4),
        contract("x", 1, 5, "y", 1, 4),
        contract("x", 2, 4, "y", 2, 4),
        contract("x", 1, 4, "action", 1, 4),
        contract("x", 1, 4, "y", 4, 1),
    ];
    for contract in wrong {
        let error = load_network(&graph, &contract).map(|_| ()).unwrap_err();
        assert!(matches!(error, LoadError::Interface { .. }), "{error}");
    }
    let two_inputs = small().input("z", &[Dim::Fixed(1)]).node("MatMul", &["x", "w"], "y", &[]);
    assert!(refused(&two_inputs).to_string().contains("has 2 inputs [\"x\", \"z\"]"));
    // The file claims the right output shape, the graph makes another one.
    let liar = small().floats("v", &[4, 3], &numbers(1, 12)).node("MatMul", &["x", "v"], "y", &[]);
    assert!(refused(&liar).to_string().contains("output"), "{}", refused(&liar));
}

#[test]
fn graphs_that_are_not_plain_are_refused() {
    let nobody = small().node("MatMul", &["x", "w"], "z", &[]);
    assert!(refused(&nobody).to_string().contains("no node makes the output `y`"));
    let unknown = small().node("MatMul", &["ghost", "w"], "y", &[]);
    assert!(refused(&unknown).to_string().contains("reads `ghost`"));
    let twice = small().node("Relu", &["x"], "y", &[]).node("Tanh", &["x"], "y", &[]);
    assert!(refused(&twice).to_string().contains("exists already"));
    let nested = small().node("Relu", &["x"], "y", &[Attribute::Graph("body")]);
    assert!(refused(&nested).to_string().contains("sub-graph"));
    let mut old = small().node("Relu", &["x"], "y", &[]);
    old.operator_set = 99;
    assert!(refused(&old).to_string().contains("operator set 99"));
    let long = (0..64).fold(small().node("Relu", &["x"], "n0", &[]), |graph, index| {
        graph.node("Relu", &[&format!("n{index}")], &format!("n{}", index + 1), &[])
    });
    assert!(refused(&long).to_string().contains("65 nodes"));
    let error = load_network(&vec![0; MAX_MODEL_BYTES + 1], &small_contract()).map(|_| ()).unwrap_err();
    assert!(matches!(error, LoadError::TooLarge { .. }));
}

/// Sixty doublings: the file is small, the tensor would have 2^62 elements.
#[test]
fn a_graph_that_grows_without_bound_is_refused_without_memory() {
    let graph = (0..60).fold(small().node("Relu", &["x"], "n0", &[]), |graph, index| {
        let x = format!("n{index}");
        graph.node("Concat", &[&x, &x], &format!("n{}", index + 1), &[Attribute::Int("axis", 1)])
    });
    let error = refused(&graph.node("Relu", &["n60"], "y", &[]));
    assert!(matches!(error, LoadError::Wiring { .. }), "{error}");
}

/// Five levels of sixteen: a million pieces, which tract would join for minutes; and weights that double.
#[test]
fn what_is_computed_in_advance_is_bounded() {
    let started = std::time::Instant::now();
    let nested = (0..5).fold(small().node("Relu", &["x"], "n0", &[]), |graph, index| {
        let x = format!("n{index}");
        graph.node("Concat", &[x.as_str(); 16], &format!("n{}", index + 1), &[Attribute::Int("axis", 1)])
    });
    let error = refused(&nested.node("Relu", &["n5"], "y", &[]));
    assert!(error.to_string().contains("more than 1024 parts"), "{error}");
    let weights = (0..40).fold(small().node("Identity", &["w"], "n0", &[]), |graph, index| {
        let x = format!("n{index}");
        graph.node("Concat", &[&x, &x], &format!("n{}", index + 1), &[Attribute::Int("axis", 1)])
    });
    let error = refused(&weights.node("MatMul", &["x", "n40"], "y", &[]));
    assert!(error.to_string().contains("parts"), "{error}");
    assert!(started.elapsed().as_secs() < 5, "at once");
}

#[test]
fn truncated_and_flipped_files_never_panic() {
    for (name, bytes, contract) in [models::flattened(), models::branches()] {
        for len in 0..bytes.len() {
            let loaded = load_network(&bytes[..len], &contract);
            assert!(loaded.is_err(), "{name} loads with {len} of {} bytes", bytes.len());
        }
        let mut refused = 0;
        for position in (0..bytes.len()).step_by(3) {
            let mut flipped = bytes.clone();
            flipped[position] ^= 1 << (position % 8);
            // A flipped weight still loads, and then still agrees with tract.
            match load_network(&flipped, &contract) {
                Ok(loaded) => assert!(loaded.parity() <= 1e-5),
                Err(error) => {
                    assert!(!error.to_string().is_empty());
                    refused += 1;
                }
            }
        }
        assert!(refused > 0, "{name}: no flip was noticed");
    }
}
