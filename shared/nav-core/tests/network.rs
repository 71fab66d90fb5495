//! The network executor against a naive `f64` reference, over random shapes and on every instruction level of the machine.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nav_core::network::{
    Activation, Combine, CpuLevel, Layer, MAX_STEPS, MlpSpec, MlpWeights, Network, NetworkError, NetworkSpec,
    Reduce,
};
use proptest::prelude::*;

/// Largest difference from the reference, relative to the larger of one and the result.
const TOLERANCE: f64 = 1e-5;

fn levels() -> Vec<CpuLevel> {
    [CpuLevel::Portable, CpuLevel::Avx2, CpuLevel::Avx512]
        .into_iter()
        .filter(|level| level.is_available())
        .collect()
}

/// Numbers in `[-1, 1)` from a small generator, the same on every run.
fn numbers(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn pack(spec: &NetworkSpec<'_>, level: CpuLevel) -> Network<Vec<f32>> {
    Network::new(spec, vec![0.0; spec.memory_len(level)], level).unwrap()
}

fn run(network: &mut Network<Vec<f32>>, input: &[f32]) -> Vec<f32> {
    let mut output = vec![0.0; network.output_len()];
    network.run(input, &mut output);
    output
}

fn close(found: &[f32], expected: &[f64]) -> Result<(), String> {
    assert_eq!(found.len(), expected.len());
    for (index, (&found, &expected)) in found.iter().zip(expected).enumerate() {
        let error = (f64::from(found) - expected).abs() / expected.abs().max(1.0);
        if error.is_nan() || error > TOLERANCE {
            return Err(format!("element {index}: {found}, expected {expected}"));
        }
    }
    Ok(())
}

fn same_bits(a: &[f32], b: &[f32]) -> bool {
    a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()))
}

fn reference_activation(activation: Activation, x: f64) -> f64 {
    match activation {
        Activation::Identity => x,
        Activation::Relu => x.max(0.0),
        Activation::LeakyRelu { slope } => {
            if x < 0.0 {
                f64::from(slope) * x
            } else {
                x
            }
        }
        Activation::Tanh => x.tanh(),
        Activation::Sigmoid => 1.0 / (1.0 + (-x).exp()),
        Activation::Silu => x / (1.0 + (-x).exp()),
        Activation::Softplus => x.exp().ln_1p(),
        Activation::Clip { min, max } => x.clamp(f64::from(min), f64::from(max)),
    }
}

/// One row through one layer, in `f64`.
fn reference_layer(x: &[f64], weights: &[f32], bias: &[f32], activation: Activation) -> Vec<f64> {
    weights
        .chunks(x.len())
        .zip(bias)
        .map(|(row, &bias)| {
            let sum: f64 = row.iter().zip(x).map(|(&w, &x)| f64::from(w) * x).sum();
            reference_activation(activation, sum + f64::from(bias))
        })
        .collect()
}

struct Mlp {
    sizes: Vec<usize>,
    weights: Vec<Vec<f32>>,
    biases: Vec<Vec<f32>>,
    hidden: Activation,
    output: Activation,
}

impl Mlp {
    fn new(sizes: &[usize], hidden: Activation, output: Activation, seed: u64) -> Self {
        let scaled = |seed, count, inputs: usize| -> Vec<f32> {
            numbers(seed, count).into_iter().map(|w| w * 1.5 / (inputs as f32).sqrt()).collect()
        };
        let layers = || sizes.windows(2).enumerate();
        Self {
            sizes: sizes.to_vec(),
            weights: layers().map(|(i, s)| scaled(seed + i as u64, s[0] * s[1], s[0])).collect(),
            biases: layers().map(|(i, s)| scaled(seed + 100 + i as u64, s[1], 4)).collect(),
            hidden,
            output,
        }
    }

    fn layers(&self) -> Vec<Layer<'_>> {
        self.weights.iter().zip(&self.biases).map(|(weights, bias)| Layer { weights, bias }).collect()
    }

    fn shape(&self, rows: usize) -> MlpSpec {
        MlpSpec::new(&self.sizes).unwrap().hidden(self.hidden).output(self.output).rows(rows)
    }

    fn reference(&self, input: &[f32]) -> Vec<f64> {
        let mut result = Vec::new();
        for row in input.chunks(self.sizes[0]) {
            let mut x: Vec<f64> = row.iter().map(|&x| f64::from(x)).collect();
            for (index, (weights, bias)) in self.weights.iter().zip(&self.biases).enumerate() {
                let last = index + 1 == self.weights.len();
                x = reference_layer(&x, weights, bias, if last { self.output } else { self.hidden });
            }
            result.extend(x);
        }
        result
    }
}

fn any_activation() -> impl Strategy<Value = Activation> {
    prop_oneof![
        Just(Activation::Identity),
        Just(Activation::Relu),
        Just(Activation::LeakyRelu { slope: 0.01 }),
        Just(Activation::Tanh),
        Just(Activation::Sigmoid),
        Just(Activation::Silu),
        Just(Activation::Softplus),
        Just(Activation::Clip { min: -0.3, max: 0.7 }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn perceptrons_match_the_reference(
        sizes in prop::collection::vec(1_usize..300, 2..5),
        rows in 1_usize..20,
        hidden in any_activation(),
        output in any_activation(),
        seed in 0_u64..1 << 40,
    ) {
        let mlp = Mlp::new(&sizes, hidden, output, seed);
        let layers = mlp.layers();
        let spec = mlp.shape(rows).spec(&MlpWeights::new(&layers)).unwrap();
        let input = numbers(seed ^ 77, rows * sizes[0]);
        let expected = mlp.reference(&input);
        for level in levels() {
            let mut network = pack(&spec, level);
            let found = run(&mut network, &input);
            close(&found, &expected).map_err(|e| TestCaseError::fail(format!("{level}: {e}")))?;
            let again = run(&mut network, &input);
            prop_assert!(same_bits(&found, &again), "{level}: a second run differs");
        }
    }

    #[test]
    fn a_row_of_a_batch_has_the_bits_of_the_row_alone(
        inputs in 1_usize..150,
        outputs in 1_usize..150,
        rows in 2_usize..19,
        seed in 0_u64..1 << 40,
    ) {
        let mlp = Mlp::new(&[inputs, outputs], Activation::Tanh, Activation::Identity, seed);
        let layers = mlp.layers();
        let weights = MlpWeights::new(&layers);
        let input = numbers(seed ^ 5, rows * inputs);
        for level in levels() {
            let batch = run(&mut pack(&mlp.shape(rows).spec(&weights).unwrap(), level), &input);
            let mut alone = pack(&mlp.shape(1).spec(&weights).unwrap(), level);
            for (row, expected) in input.chunks(inputs).zip(batch.chunks(outputs)) {
                prop_assert!(same_bits(&run(&mut alone, row), expected), "{level}");
            }
        }
    }
}

#[test]
fn normalisation_comes_before_the_layers() {
    let mlp = Mlp::new(&[5, 7, 2], Activation::Relu, Activation::Tanh, 3);
    let layers = mlp.layers();
    let (mean, inverse) = (numbers(8, 5), [0.5, 2.0, 1.0, 4.0, 0.25]);
    let weights = MlpWeights::new(&layers).normalisation(&mean, &inverse);
    let input = numbers(9, 5);
    let normal: Vec<f32> = input.iter().zip(&mean).zip(&inverse).map(|((x, m), i)| (x - m) * i).collect();
    let mut network = pack(&mlp.shape(1).spec(&weights).unwrap(), CpuLevel::detect());
    close(&run(&mut network, &input), &mlp.reference(&normal)).unwrap();
}

#[test]
fn layer_norm_means_slices_and_concatenation() {
    let (rows, cols) = (3, 21);
    let (gain, bias) = (numbers(1, cols), numbers(2, cols));
    let mut spec = NetworkSpec::new();
    let x = spec.input(rows, cols).unwrap();
    let normal = spec.layer_norm(x, &gain, &bias, 1e-5).unwrap();
    let left = normal.columns(0, 1).unwrap();
    let right = normal.columns(1, cols - 1).unwrap();
    let mean = spec.reduce(Reduce::Mean, right).unwrap();
    let centred = spec.combine(Combine::Sub, right, mean).unwrap();
    let dueling = spec.combine(Combine::Add, left, centred).unwrap();
    let sum = spec.reduce(Reduce::Sum, right).unwrap();
    let joined = spec.concat(&[dueling, sum, left]).unwrap();
    spec.output(joined).unwrap();

    let input = numbers(3, rows * cols);
    let mut expected = Vec::new();
    for row in input.chunks(cols) {
        let row: Vec<f64> = row.iter().map(|&x| f64::from(x)).collect();
        let mean = row.iter().sum::<f64>() / cols as f64;
        let variance = row.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / cols as f64;
        let normal: Vec<f64> = (0..cols)
            .map(|i| (row[i] - mean) / (variance + 1e-5).sqrt() * f64::from(gain[i]) + f64::from(bias[i]))
            .collect();
        let advantages = &normal[1..];
        let sum: f64 = advantages.iter().sum();
        expected.extend(advantages.iter().map(|a| normal[0] + a - sum / advantages.len() as f64));
        expected.extend([sum, normal[0]]);
    }
    for level in levels() {
        close(&run(&mut pack(&spec, level), &input), &expected).unwrap();
    }
}

#[test]
fn combinations_broadcast_and_keep_nan() {
    let mut spec = NetworkSpec::new();
    let x = spec.input(2, 3).unwrap();
    let column = x.columns(0, 1).unwrap();
    let scaled = spec.combine(Combine::Mul, x, column).unwrap();
    let limited = spec.combine(Combine::Max, scaled, &[0.0][..]).unwrap();
    let limited = spec.combine(Combine::Min, &[4.0][..], limited).unwrap();
    let divided = spec.combine(Combine::Div, limited, &[1.0, 2.0, 4.0][..]).unwrap();
    spec.output(divided.reshaped(1, 6).unwrap()).unwrap();
    let mut network = pack(&spec, CpuLevel::detect());
    let found = run(&mut network, &[2.0, -1.0, 8.0, 1.0, 3.0, f32::NAN]);
    close(&found[..5], &[4.0, 0.0, 1.0, 1.0, 1.5]).unwrap();
    assert!(found[5].is_nan());
}

#[test]
fn repacking_gives_the_bits_of_a_new_network_and_refuses_other_shapes() {
    let first = Mlp::new(&[24, 130, 3], Activation::Relu, Activation::Tanh, 1);
    let second = Mlp::new(&[24, 130, 3], Activation::Relu, Activation::Tanh, 2);
    let other = Mlp::new(&[24, 131, 3], Activation::Relu, Activation::Tanh, 2);
    let (first_layers, second_layers, other_layers) = (first.layers(), second.layers(), other.layers());
    let second_spec = second.shape(1).spec(&MlpWeights::new(&second_layers)).unwrap();
    let input = numbers(4, 24);
    for level in levels() {
        let mut network = pack(&first.shape(1).spec(&MlpWeights::new(&first_layers)).unwrap(), level);
        let before = run(&mut network, &input);
        let refused = network.repack(&other.shape(1).spec(&MlpWeights::new(&other_layers)).unwrap());
        assert_eq!(refused, Err(NetworkError::OtherStructure));
        assert!(same_bits(&before, &run(&mut network, &input)), "a refused refresh changed the network");
        network.repack(&second_spec).unwrap();
        assert!(same_bits(&run(&mut network, &input), &run(&mut pack(&second_spec, level), &input)));
    }
}

#[test]
fn memory_may_start_anywhere_and_is_checked() {
    let mlp = Mlp::new(&[9, 40, 5], Activation::Relu, Activation::Identity, 6);
    let layers = mlp.layers();
    let spec = mlp.shape(2).spec(&MlpWeights::new(&layers)).unwrap();
    let input = numbers(7, 18);
    for level in levels() {
        let expected = run(&mut pack(&spec, level), &input);
        let mut memory = vec![f32::NAN; spec.memory_len(level) + 16];
        for start in 0..16 {
            let mut network = Network::new(&spec, &mut memory[start..], level).unwrap();
            let mut output = [0.0; 10];
            network.run(&input, &mut output);
            assert!(same_bits(&expected, &output), "{level} from {start}");
        }
        let (needed, given) = (spec.memory_len(level), spec.memory_len(level) - 1);
        let refused = Network::new(&spec, &mut memory[..given], level).map(|_| ()).unwrap_err();
        assert_eq!(refused, NetworkError::Memory { needed, given });
    }
}

#[test]
fn wrong_shapes_are_refused() {
    let mut spec = NetworkSpec::new();
    let x = spec.input(1, 4).unwrap();
    assert_eq!(spec.input(1, 4), Err(NetworkError::Input));
    assert!(matches!(spec.linear(x, &[0.0; 7], None, Activation::Relu), Err(NetworkError::Length { .. })));
    assert!(matches!(spec.linear(x, &[], None, Activation::Relu), Err(NetworkError::Length { .. })));
    assert!(matches!(
        spec.linear(x, &[0.0; 8], Some(&[0.0]), Activation::Relu),
        Err(NetworkError::Length { .. })
    ));
    assert!(matches!(spec.combine(Combine::Add, x, &[0.0; 3][..]), Err(NetworkError::Length { .. })));
    assert!(matches!(spec.combine(Combine::Add, x, &[][..]), Err(NetworkError::Side { length: 0 })));
    assert!(x.columns(2, 3).is_err() && x.columns(usize::MAX, 2).is_err() && x.reshaped(2, 3).is_err());
    let foreign = NetworkSpec::new().input(1, 4000).unwrap();
    assert_eq!(spec.output(foreign), Err(NetworkError::ForeignValue));
    assert!(matches!(NetworkSpec::new().input(1 << 16, 1 << 16), Err(NetworkError::TooLarge)));
    let full = (0..=MAX_STEPS).try_fold(x, |x, _| spec.apply(x, Activation::Relu));
    assert_eq!(full, Err(NetworkError::TooManySteps));
    let error = Network::new(&NetworkSpec::new(), vec![], CpuLevel::Portable).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "a network needs exactly one input: call `input` once, first");
}
