//! From untrusted ONNX bytes to a network that runs without allocating.
//!
//! [`read_file`] reads and hashes a file; [`load_network`] takes its bytes through
//! 1. the preflight, once weights of other files and widths are plain ones in the model: bounds, an operator allow-list,
//!    finite weights, exact names and shapes;
//! 2. tract, which parses, types and declutters the graph;
//! 3. lowering to [`nav_core::network`] and packing into an [`Arena`] on huge pages;
//! 4. parity: executor and tract must agree on [`PARITY_CASES`] inputs within [`PARITY_TOLERANCE`].
//!
//! A model that fails any of them is refused with one sentence that names what and where. Panics inside tract are caught; an
//! allocation that aborts is not, so that a wary caller loads once in a child process with a memory limit.
//!
//! # What can be loaded
//! One input and one output, both matrices of `f32`, and the operators Gemm, MatMul, Add, Sub, Mul, Div, Max, Min, Clip, Relu,
//! LeakyRelu, Tanh, Sigmoid, SiLU (as `x * Sigmoid(x)`), Softplus, LayerNormalization (also spelled out with Pow and Sqrt),
//! ReduceSum and ReduceMean over the last axis, Flatten, Reshape, Squeeze, Unsqueeze, Slice, Split, Concat, Identity, Constant;
//! of weights also Cast and Transpose. Weights that nothing reads are ignored, nodes may share a name. Floats of 16 and 64 bits
//! are loaded as floats of 32, and the network computes in these; weights may lie in files beside the model that the manifest
//! lists.

mod file;
mod contract;
mod tidy;
mod external;
mod plain;
mod preflight;
mod weights;
mod lower;
mod dims;
mod einsum;
mod fold;
mod program;
mod arena;
mod oracle;
mod parity;
mod error;

pub use arena::Arena;
pub use contract::{NetworkContract, Port};
pub use error::LoadError;
pub use external::DataFile;
pub use file::{FileBytes, FileError, read_file, read_file_in, read_named_file};
pub use oracle::TractOracle;
pub use parity::{PARITY_CASES, PARITY_TOLERANCE};
pub use preflight::{MAX_MODEL_BYTES, MAX_NODES};

use nav_core::network::{CpuLevel, Network};
use oracle::guarded;
use prost::Message;
use tract_onnx::prelude::{Framework, InferenceModelExt, TypedModel};
use tract_onnx::tract_hir::infer::InferenceFact;

/// A network that was lowered and agrees with tract.
#[derive(Debug)]
pub struct LoadedNetwork {
    network: Network<Arena>,
    oracle: TractOracle,
    contract: NetworkContract,
    parity: f32,
    operators: String,
    onnx: Vec<u8>,
}

impl LoadedNetwork {
    /// The executor.
    pub fn network(&self) -> &Network<Arena> {
        &self.network
    }

    /// The executor, to run it.
    pub fn network_mut(&mut self) -> &mut Network<Arena> {
        &mut self.network
    }

    /// tract's plan of the same model.
    pub fn oracle(&self) -> &TractOracle {
        &self.oracle
    }

    /// Names and shapes that were checked.
    pub fn contract(&self) -> &NetworkContract {
        &self.contract
    }

    /// The largest difference between executor and tract, relative as [`PARITY_TOLERANCE`] says.
    pub fn parity(&self) -> f32 {
        self.parity
    }

    /// What tract made of its nodes, for people: `2 EinSum, 1 Tanh`, in order of first use.
    pub fn operators(&self) -> &str {
        &self.operators
    }

    /// The bytes it was loaded from, for another engine; weights that lay in other files are in them.
    pub fn onnx(&self) -> &[u8] {
        &self.onnx
    }

    /// The executor alone, for the controller.
    pub fn into_network(self) -> Network<Arena> {
        self.network
    }
}

/// Loads a model for the fastest instructions of this machine.
///
/// # Errors
/// When the model is damaged, does not fit `contract`, uses what the executor cannot run, or disagrees with tract.
pub fn load_network(bytes: &[u8], contract: &NetworkContract) -> Result<LoadedNetwork, LoadError> {
    load_network_at(bytes, contract, CpuLevel::detect())
}

/// Loads a model for a given instruction level, for comparisons between machines.
///
/// # Errors
/// As [`load_network`], and when this machine lacks the level.
pub fn load_network_at(
    bytes: &[u8],
    contract: &NetworkContract,
    level: CpuLevel,
) -> Result<LoadedNetwork, LoadError> {
    load(bytes, &[], contract, level)
}

/// Loads a model that may keep weights in files beside it.
///
/// # Errors
/// As [`load_network`], and when the files do not hold what the model says.
pub fn load_network_with(
    bytes: &[u8],
    files: &[DataFile<'_>],
    contract: &NetworkContract,
) -> Result<LoadedNetwork, LoadError> {
    load(bytes, files, contract, CpuLevel::detect())
}

fn load(
    bytes: &[u8],
    files: &[DataFile<'_>],
    contract: &NetworkContract,
    level: CpuLevel,
) -> Result<LoadedNetwork, LoadError> {
    let (typed, onnx) = parse(bytes, files, contract)?;
    let operators = counted(typed.nodes().iter().map(|node| node.op.name().into_owned()));
    let program = guarded(|| Ok(lower::lower(&typed, contract)))??;
    let spec = program.spec()?;
    let memory = Arena::new(spec.memory_len(level)).map_err(LoadError::Memory)?;
    let mut network = Network::new(&spec, memory, level)?;
    let oracle = TractOracle::new(typed, contract)?;
    let parity = parity::compare(&mut network, &oracle)?;
    Ok(LoadedNetwork { network, oracle, contract: contract.clone(), parity, operators, onnx })
}

/// How often each name comes, in order of first use; inputs and constants are no work.
fn counted(names: impl Iterator<Item = String>) -> String {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for name in names.filter(|name| name != "Source" && name != "Const") {
        match counts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    counts.iter().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>().join(", ")
}

/// Bytes to a typed, decluttered graph whose input has the contract's shape, and the bytes of the whole model.
fn parse(
    bytes: &[u8],
    files: &[DataFile<'_>],
    contract: &NetworkContract,
) -> Result<(TypedModel, Vec<u8>), LoadError> {
    if bytes.len() > MAX_MODEL_BYTES {
        return Err(LoadError::TooLarge { bytes: bytes.len(), limit: MAX_MODEL_BYTES });
    }
    // Shapes of inner values are inferred, never believed.
    let onnx = tract_onnx::onnx().with_ignore_value_info(true);
    let mut model = onnx
        .proto_model_for_read(&mut &*bytes)
        .map_err(|error| LoadError::Malformed { problem: format!("{error:#}") })?;
    tidy::tidy(&mut model);
    let is_joined = external::take_in(&mut model, files, MAX_MODEL_BYTES - bytes.len())?;
    let whole = if is_joined { model.encode_to_vec() } else { bytes.to_vec() };
    plain::make_plain(&mut model);
    preflight::check(&model, contract)?;
    let typed = guarded(|| {
        let input = InferenceFact::dt_shape(
            tract_onnx::prelude::DatumType::F32,
            [contract.input.rows, contract.input.cols],
        );
        onnx.model_for_proto_model(&model)?.with_input_fact(0, input)?.into_typed()?.into_decluttered()
    })?;
    Ok((typed, whole))
}
