//! The hand-written derivatives against libtorch's automatic ones.

use rand::{RngExt, SeedableRng};
use tch::{Device, Kind, Tensor};

use super::{Activation, Adam, Buffer, Mlp, MlpShape, Rng, flat, layer_norm};

/// Largest difference between the two derivatives, relative to the largest derivative of the block.
const TOLERANCE: f32 = 2e-5;

fn uniform(count: usize, rng: &mut Rng) -> Vec<f32> {
    (0..count).map(|_| 2.0 * rng.random::<f32>() - 1.0).collect()
}

fn matrix(values: &[f32], rows: usize) -> Tensor {
    Tensor::from_slice(values).reshape([rows as i64, -1])
}

fn values(tensor: &Tensor) -> Vec<f32> {
    Vec::try_from(tensor.to_kind(Kind::Float).reshape([-1])).expect("a tensor of numbers")
}

/// The same network through automatic differentiation: output, and all leaves in the order of the layers.
fn reference(mlp: &Mlp, x: &Tensor) -> (Tensor, Vec<Tensor>) {
    let leaf = |values: &[f32], rows: usize| matrix(values, rows).set_requires_grad(true);
    let count = mlp.layers().count();
    let (mut y, mut leaves) = (x.shallow_clone(), Vec::new());
    for (index, layer) in mlp.layers().enumerate() {
        let (weight, bias) = (leaf(layer.weight, layer.outputs), leaf(layer.bias, 1));
        y = y.matmul(&weight.tr()) + &bias;
        leaves.extend([weight, bias]);
        if let Some((scale, shift)) = layer.norm {
            let (scale, shift) = (leaf(scale, 1), leaf(shift, 1));
            let width = [layer.outputs as i64];
            let epsilon = f64::from(layer_norm::EPSILON);
            y = y.layer_norm(width, Some(&scale.reshape(width)), Some(&shift.reshape(width)), epsilon, false);
            leaves.extend([scale, shift]);
        }
        if index + 1 < count {
            y = y.relu();
        } else if mlp.shape().output == Activation::Tanh {
            y = y.tanh();
        }
    }
    (y, leaves)
}

/// The flat gradient buffer cut into the blocks of [`reference`].
fn blocks(mlp: &Mlp) -> Vec<Vec<f32>> {
    let base = mlp.parameters().as_ptr() as usize;
    let gradients = mlp.gradients();
    let cut = |slice: &[f32]| {
        let start = (slice.as_ptr() as usize - base) / size_of::<f32>();
        gradients[start..start + slice.len()].to_vec()
    };
    let layers = mlp.layers().map(|layer| {
        let norm = layer.norm.map(|(scale, shift)| [cut(scale), cut(shift)]);
        [cut(layer.weight), cut(layer.bias)].into_iter().chain(norm.into_iter().flatten())
    });
    layers.flatten().collect()
}

fn assert_close(ours: &[f32], theirs: &[f32], what: &str) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let size = theirs.iter().fold(1e-3_f32, |size, value| size.max(value.abs()));
    for (ours, theirs) in ours.iter().zip(theirs) {
        assert!((ours - theirs).abs() <= TOLERANCE * size, "{what}: {ours} and {theirs}");
    }
}

fn shapes() -> Vec<MlpShape> {
    let mut shapes = Vec::new();
    for hidden in [&[][..], &[19], &[32, 17], &[24, 24, 24]] {
        for output in [Activation::Identity, Activation::Tanh] {
            for layer_norm in [false, true] {
                shapes.push(MlpShape { layer_norm, ..MlpShape::new(13, hidden, 3, output) });
            }
        }
    }
    shapes
}

#[test]
fn derivatives_match_automatic_differentiation() {
    let mut rng = Rng::seed_from_u64(1);
    for shape in shapes() {
        let mut mlp = Mlp::new(shape.clone(), &mut rng);
        for parameter in mlp.parameters_mut() {
            *parameter += 0.1 * (2.0 * rng.random::<f32>() - 1.0);
        }
        // Growing, shrinking and growing again, so that the tape is resized both ways.
        for rows in [5, 33, 1, 16] {
            let given = Buffer::of(&uniform(rows * 13, &mut rng), 13);
            let x = matrix(given.as_slice(), rows).set_requires_grad(true);
            let slope = uniform(rows * 3, &mut rng);
            let (y, leaves) = reference(&mlp, &x);
            (y.shallow_clone() * matrix(&slope, rows)).sum(Kind::Float).backward();
            mlp.zero_gradients();
            assert_close(mlp.forward(&given.view(rows)), &values(&y), "output");
            mlp.backward(&given.view(rows), &slope);
            for (ours, leaf) in blocks(&mlp).iter().zip(&leaves) {
                assert_close(ours, &values(&leaf.grad()), &format!("{shape:?} with {rows} rows"));
            }
            let before = mlp.gradients().to_vec();
            assert_close(mlp.input_gradient(&slope, 0..13), &values(&x.grad()), "input");
            let some_columns = values(&x.grad().narrow(1, 4, 6));
            assert_close(mlp.input_gradient(&slope, 4..10), &some_columns, "input columns");
            assert_eq!(before, mlp.gradients(), "an input gradient leaves the parameter gradients alone");
        }
    }
}

#[test]
fn a_slope_floor_acts_only_in_the_flat_ends_and_only_inwards() {
    let mut rng = Rng::seed_from_u64(8);
    let mut mlp = Mlp::new(MlpShape::new(2, &[], 1, Activation::Tanh), &mut rng);
    let mut bias_gradient = |shift: f32, slope: f32, floor: f32| {
        mlp.parameters_mut().fill(0.0);
        mlp.shift_outputs(shift);
        let x = Buffer::of(&[0.3, -0.2], 2);
        mlp.forward(&x.view(1));
        mlp.zero_gradients();
        mlp.backward_with_slope_floor(&x.view(1), &[slope], floor);
        blocks(&mlp)[1][0]
    };
    // Descending against a gradient of the output's sign moves it inwards.
    assert_close(&[bias_gradient(20.0, 2.0, 0.1)], &[0.2], "inwards from the upper end");
    assert_close(&[bias_gradient(-20.0, -2.0, 0.1)], &[-0.2], "inwards from the lower end");
    assert_close(&[bias_gradient(20.0, -2.0, 0.1)], &[0.0], "outwards");
    assert_close(&[bias_gradient(20.0, 2.0, 0.0)], &[0.0], "the exact derivative");
    let exact = 2.0 * (1.0 - 0.5_f32.tanh().powi(2));
    assert_close(&[bias_gradient(0.5, 2.0, 0.1)], &[exact], "in the middle");
}

#[test]
fn gradients_add_up_until_they_are_zeroed() {
    let mut rng = Rng::seed_from_u64(2);
    let mut mlp = Mlp::new(MlpShape::new(4, &[8], 2, Activation::Tanh), &mut rng);
    let x = Buffer::of(&uniform(12, &mut rng), 4);
    let slope = uniform(6, &mut rng);
    mlp.forward(&x.view(3));
    mlp.backward(&x.view(3), &slope);
    let once = mlp.gradients().to_vec();
    mlp.forward(&x.view(3));
    mlp.backward(&x.view(3), &slope);
    let twice: Vec<_> = once.iter().map(|value| 2.0 * value).collect();
    assert_close(mlp.gradients(), &twice, "two passes");
    mlp.zero_gradients();
    assert!(mlp.gradients().iter().all(|value| *value == 0.0));
}

#[test]
fn every_parameter_receives_a_gradient() {
    let mut rng = Rng::seed_from_u64(3);
    for shape in shapes() {
        let mut mlp = Mlp::new(shape.clone(), &mut rng);
        mlp.lift_hidden_units();
        let x = Buffer::of(&uniform(400 * 13, &mut rng), 13);
        mlp.forward(&x.view(400));
        let slope = uniform(400 * 3, &mut rng);
        mlp.backward(&x.view(400), &slope);
        for block in blocks(&mlp) {
            assert!(block.iter().all(|gradient| *gradient != 0.0), "{shape:?} leaves a parameter alone");
        }
    }
}

#[test]
fn strided_input_is_read_as_its_rows() {
    let mut rng = Rng::seed_from_u64(4);
    let mut mlp = Mlp::new(MlpShape::new(5, &[16], 2, Activation::Identity), &mut rng);
    let wide = Buffer::of(&uniform(7 * 9, &mut rng), 7);
    let strided = mlp.forward(&wide.view_columns(2, 5)).to_vec();
    let narrow: Vec<f32> = (0..9).flat_map(|row| wide.row(row)[2..7].to_vec()).collect();
    assert_close(mlp.forward(&Buffer::of(&narrow, 5).view(9)), &strided, "strided rows");
}

#[test]
fn adam_takes_torch_steps() {
    let mut rng = Rng::seed_from_u64(5);
    let start = uniform(40, &mut rng);
    let mut ours = start.clone();
    let mut adam = Adam::new(40, 3e-3);
    let store = tch::nn::VarStore::new(Device::Cpu);
    let mut variable = store.root().zeros("x", &[40]);
    tch::no_grad(|| variable.copy_(&Tensor::from_slice(&start)));
    let mut torch =
        tch::nn::OptimizerConfig::build(tch::nn::Adam::default(), &store, 3e-3).expect("an optimiser");
    for _ in 0..50 {
        let gradient = uniform(40, &mut rng);
        adam.step(&mut ours, &gradient);
        torch.zero_grad();
        (&variable * Tensor::from_slice(&gradient)).sum(Kind::Float).backward();
        torch.step();
    }
    assert_close(&ours, &values(&variable), "fifty steps");
}

#[test]
fn clipping_keeps_the_direction_and_polyak_moves_by_its_rate() {
    let mut gradient = vec![3.0, 0.0, 4.0];
    assert!((flat::clip_norm(&mut gradient, 0.0) - 5.0).abs() < 1e-6);
    assert_close(&gradient, &[3.0, 0.0, 4.0], "no limit");
    assert!((flat::clip_norm(&mut gradient, 1.0) - 5.0).abs() < 1e-6);
    assert_close(&gradient, &[0.6, 0.0, 0.8], "clipped");
    let mut target = vec![0.0, 2.0];
    flat::polyak(&mut target, &[1.0, 0.0], 0.25);
    assert_close(&target, &[0.25, 1.5], "a quarter of the way");
}

#[test]
fn a_seed_gives_the_same_network_and_the_same_bits() {
    let run = |seed| {
        let mut rng = Rng::seed_from_u64(seed);
        let shape = MlpShape { layer_norm: true, ..MlpShape::new(6, &[32, 32], 1, Activation::Identity) };
        let mut mlp = Mlp::new(shape, &mut rng);
        let x = Buffer::of(&uniform(48, &mut rng), 6);
        mlp.forward(&x.view(8)).iter().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}
