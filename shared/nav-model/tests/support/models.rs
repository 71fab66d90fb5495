//! Models as trainers write them, each with its contract.
#![allow(dead_code, reason = "each test binary uses a part")]

use super::onnx::{Attribute, Dim, Graph, numbers};
use nav_model::load::{NetworkContract, Port};

/// Name, bytes and contract of a model.
pub(crate) type Model = (&'static str, Vec<u8>, NetworkContract);

pub(crate) fn contract(
    input: &str,
    rows: usize,
    cols: usize,
    output: &str,
    out_rows: usize,
    out_cols: usize,
) -> NetworkContract {
    NetworkContract::new(Port::new(input, rows, cols), Port::new(output, out_rows, out_cols))
}

fn fixed(dims: [i64; 2]) -> [Dim; 2] {
    dims.map(Dim::Fixed)
}

/// `Gemm` with `transB = 1` and its weights, named after the output.
fn gemm(graph: Graph, x: &str, y: &str, [outputs, inputs]: [i64; 2]) -> Graph {
    let (w, b) = (format!("{y}.w"), format!("{y}.b"));
    let seed = y.bytes().map(u64::from).sum::<u64>() + 7;
    graph
        .node("Gemm", &[x, &w, &b], y, &[Attribute::Int("transB", 1)])
        .floats(&w, &[outputs, inputs], &numbers(seed, (outputs * inputs) as usize))
        .floats(&b, &[outputs], &numbers(seed + 1, outputs as usize))
}

/// TD3's actor: normalisation, three layers, scaled tanh.
pub(crate) fn actor() -> Model {
    let mut graph = Graph::default()
        .input("observation", &fixed([1, 82]))
        .floats("mean", &[82], &numbers(1, 82))
        .floats("inverse", &[82], &numbers(2, 82))
        .floats("scale", &[2], &[0.5, 1.0])
        .floats("shift", &[2], &[0.5, 0.0])
        .node("Sub", &["observation", "mean"], "centred", &[])
        .node("Mul", &["centred", "inverse"], "normal", &[]);
    graph = gemm(graph, "normal", "l1", [256, 82]).node("Relu", &["l1"], "r1", &[]);
    graph = gemm(graph, "r1", "l2", [256, 256]).node("Relu", &["l2"], "r2", &[]);
    graph = gemm(graph, "r2", "l3", [2, 256]).node("Tanh", &["l3"], "t", &[]);
    let graph = graph
        .node("Mul", &["t", "scale"], "scaled", &[])
        .node("Add", &["scaled", "shift"], "action", &[])
        .output("action", &fixed([1, 2]));
    ("actor", graph.finish(), contract("observation", 1, 82, "action", 1, 2))
}

/// The candidate scorer: one row a candidate, a layer as `MatMul` and `Add`.
pub(crate) fn scorer() -> Model {
    let graph = Graph::default()
        .input("candidates", &fixed([18, 101]))
        .floats("mean", &[1, 101], &numbers(1, 101))
        .floats("w2", &[64, 64], &numbers(3, 4096))
        .floats("b2", &[64], &numbers(4, 64))
        .node("Sub", &["candidates", "mean"], "normal", &[]);
    let graph = gemm(graph, "normal", "l1", [64, 101])
        .node("Relu", &["l1"], "r1", &[])
        .node("MatMul", &["r1", "w2"], "product", &[])
        .node("Add", &["product", "b2"], "l2", &[])
        .node("Relu", &["l2"], "r2", &[]);
    let graph = gemm(graph, "r2", "q", [1, 64]).output("q", &fixed([18, 1]));
    ("scorer", graph.finish(), contract("candidates", 18, 101, "q", 18, 1))
}

/// A layer normalisation as one operator.
pub(crate) fn layer_norm() -> Model {
    let graph = gemm(Graph::default().input("x", &fixed([3, 10])), "x", "l1", [40, 10])
        .floats("gain", &[40], &numbers(5, 40))
        .floats("bias", &[40], &numbers(6, 40))
        .node("LayerNormalization", &["l1", "gain", "bias"], "n", &[Attribute::Float("epsilon", 1e-5)])
        .node("Relu", &["n"], "r", &[]);
    let graph = gemm(graph, "r", "y", [4, 40]).output("y", &fixed([3, 4]));
    ("layer norm", graph.finish(), contract("x", 3, 10, "y", 3, 4))
}

/// A layer normalisation as older exporters spell it out.
pub(crate) fn spelled_layer_norm() -> Model {
    let mean = [Attribute::Ints("axes", vec![-1])];
    let graph = gemm(Graph::default().input("x", &fixed([1, 10])), "x", "l1", [40, 10])
        .floats("gain", &[40], &numbers(5, 40))
        .floats("two", &[], &[2.0])
        .floats("epsilon", &[], &[1e-5])
        .node("ReduceMean", &["l1"], "m", &mean)
        .node("Sub", &["l1", "m"], "d", &[])
        .node("Pow", &["d", "two"], "square", &[])
        .node("ReduceMean", &["square"], "v", &mean)
        .node("Add", &["v", "epsilon"], "ve", &[])
        .node("Sqrt", &["ve"], "deviation", &[])
        .node("Div", &["d", "deviation"], "n", &[])
        .node("Mul", &["n", "gain"], "scaled", &[])
        .node("Sigmoid", &["scaled"], "s", &[]);
    let graph = gemm(graph, "s", "y", [4, 40]).output("y", &fixed([1, 4]));
    ("spelled layer norm", graph.finish(), contract("x", 1, 10, "y", 1, 4))
}

/// A dueling head with two rows.
pub(crate) fn dueling() -> Model {
    let graph = gemm(Graph::default().input("x", &fixed([2, 10])), "x", "l1", [32, 10]);
    let graph = gemm(graph.node("Relu", &["l1"], "r1", &[]), "r1", "value", [1, 32]);
    let graph = gemm(graph, "r1", "advantages", [8, 32])
        .node(
            "ReduceMean",
            &["advantages"],
            "m",
            &[Attribute::Ints("axes", vec![1]), Attribute::Int("keepdims", 1)],
        )
        .node("Sub", &["advantages", "m"], "centred", &[])
        .node("Add", &["value", "centred"], "q", &[])
        .output("q", &fixed([2, 8]));
    ("dueling", graph.finish(), contract("x", 2, 10, "q", 2, 8))
}

/// What stable-baselines3 exports: a symbolic batch, `Flatten`, here with SiLU and a last layer without bias.
pub(crate) fn flattened() -> Model {
    let symbolic = |cols| [Dim::Symbol("batch"), Dim::Fixed(cols)];
    let graph = Graph::default().input("obs", &symbolic(10)).node("Flatten", &["obs"], "f", &[]);
    let graph = gemm(graph, "f", "l1", [16, 10])
        .node("Sigmoid", &["l1"], "s", &[])
        .node("Mul", &["l1", "s"], "silu", &[])
        .floats("w2", &[16, 2], &numbers(9, 32))
        .node("MatMul", &["silu", "w2"], "l2", &[])
        .node("Tanh", &["l2"], "action", &[])
        .output("action", &symbolic(2));
    ("flattened", graph.finish(), contract("obs", 1, 10, "action", 1, 2))
}

/// Slices, a concatenation, limits and the rarer functions, over several rows.
pub(crate) fn branches() -> Model {
    let graph = Graph::default()
        .input("x", &fixed([4, 10]))
        .ints("zero", &[0])
        .ints("six", &[6])
        .ints("ten", &[10])
        .ints("axis", &[1])
        .floats("low", &[], &[0.1])
        .floats("high", &[], &[0.9])
        .ints("shape", &[2, 8])
        .node("Slice", &["x", "zero", "six", "axis"], "a", &[])
        .node("Slice", &["x", "six", "ten", "axis"], "b", &[]);
    let graph = gemm(graph, "a", "l1", [5, 6])
        .node("Sigmoid", &["l1"], "s", &[])
        .node("Concat", &["s", "b", "l1"], "c", &[Attribute::Int("axis", 1)])
        .node("Mul", &["c", "c"], "square", &[])
        .node("Div", &["square", "high"], "quotient", &[]);
    let graph = gemm(graph, "quotient", "l2", [4, 14])
        .node("LeakyRelu", &["l2"], "leaky", &[Attribute::Float("alpha", 0.2)])
        .node("Softplus", &["leaky"], "soft", &[])
        .node("Identity", &["soft"], "same", &[])
        .node("Clip", &["same", "low", "high"], "limited", &[])
        .node("Reshape", &["limited", "shape"], "y", &[])
        .output("y", &fixed([2, 8]));
    ("branches", graph.finish(), contract("x", 4, 10, "y", 2, 8))
}

/// All of them.
pub(crate) fn all() -> Vec<Model> {
    vec![actor(), scorer(), layer_norm(), spelled_layer_norm(), dueling(), flattened(), branches()]
}
