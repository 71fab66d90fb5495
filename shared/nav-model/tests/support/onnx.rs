//! Writes small ONNX files, field by field of the protobuf schema, so that tests can also write wrong ones.
#![allow(dead_code, reason = "each test binary uses a part")]

/// Protobuf fields of one message.
#[derive(Clone, Default)]
pub(crate) struct Message(pub(crate) Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    pub(crate) fn int(mut self, field: u64, value: i64) -> Self {
        self.varint(field << 3);
        self.varint(value as u64);
        self
    }

    pub(crate) fn float(mut self, field: u64, value: f32) -> Self {
        self.varint(field << 3 | 5);
        self.0.extend(value.to_le_bytes());
        self
    }

    pub(crate) fn bytes(mut self, field: u64, value: &[u8]) -> Self {
        self.varint(field << 3 | 2);
        self.varint(value.len() as u64);
        self.0.extend(value);
        self
    }

    pub(crate) fn text(self, field: u64, value: &str) -> Self {
        self.bytes(field, value.as_bytes())
    }

    pub(crate) fn message(self, field: u64, value: &Message) -> Self {
        self.bytes(field, &value.0)
    }
}

/// A dimension of a graph input or output.
#[derive(Clone, Copy)]
pub(crate) enum Dim {
    Fixed(i64),
    Symbol(&'static str),
}

/// An attribute of a node.
#[derive(Clone)]
pub(crate) enum Attribute {
    Int(&'static str, i64),
    Float(&'static str, f32),
    Ints(&'static str, Vec<i64>),
    Graph(&'static str),
}

/// A graph under construction.
#[derive(Clone)]
pub(crate) struct Graph {
    pub(crate) body: Message,
    pub(crate) operator_set: i64,
}

impl Default for Graph {
    fn default() -> Self {
        Self { body: Message::default().text(2, "test"), operator_set: 17 }
    }
}

impl Graph {
    pub(crate) fn node(
        mut self,
        operator: &str,
        inputs: &[&str],
        output: &str,
        attributes: &[Attribute],
    ) -> Self {
        let mut node = Message::default();
        for input in inputs {
            node = node.text(1, input);
        }
        node = node.text(2, output).text(3, &format!("make {output}")).text(4, operator);
        for attribute in attributes {
            let message = match attribute {
                Attribute::Int(name, value) => Message::default().text(1, name).int(3, *value).int(20, 2),
                Attribute::Float(name, value) => Message::default().text(1, name).float(2, *value).int(20, 1),
                Attribute::Ints(name, values) => {
                    values.iter().fold(Message::default().text(1, name).int(20, 7), |message, value| {
                        message.int(8, *value)
                    })
                }
                Attribute::Graph(name) => {
                    Message::default().text(1, name).message(6, &Message::default()).int(20, 5)
                }
            };
            node = node.message(5, &message);
        }
        self.body = self.body.message(1, &node);
        self
    }

    pub(crate) fn floats(self, name: &str, dims: &[i64], values: &[f32]) -> Self {
        let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.tensor(tensor(name, dims, 1).bytes(9, &raw))
    }

    pub(crate) fn ints(self, name: &str, values: &[i64]) -> Self {
        let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.tensor(tensor(name, &[values.len() as i64], 7).bytes(9, &raw))
    }

    pub(crate) fn tensor(mut self, tensor: Message) -> Self {
        self.body = self.body.message(5, &tensor);
        self
    }

    pub(crate) fn input(self, name: &str, dims: &[Dim]) -> Self {
        self.port(11, name, dims)
    }

    pub(crate) fn output(self, name: &str, dims: &[Dim]) -> Self {
        self.port(12, name, dims)
    }

    fn port(self, field: u64, name: &str, dims: &[Dim]) -> Self {
        self.port_of(field, 1, name, dims)
    }

    /// An input (field 11) or output (field 12) of another type than 32-bit floats.
    pub(crate) fn port_of(mut self, field: u64, data_type: i64, name: &str, dims: &[Dim]) -> Self {
        let shape = dims.iter().fold(Message::default(), |shape, dim| {
            let dim = match dim {
                Dim::Fixed(length) => Message::default().int(1, *length),
                Dim::Symbol(symbol) => Message::default().text(2, symbol),
            };
            shape.message(1, &dim)
        });
        let tensor = Message::default().int(1, data_type).message(2, &shape);
        let kind = Message::default().message(1, &tensor);
        self.body = self.body.message(field, &Message::default().text(1, name).message(2, &kind));
        self
    }

    /// The model's bytes.
    pub(crate) fn finish(&self) -> Vec<u8> {
        let operators = Message::default().text(1, "").int(2, self.operator_set);
        Message::default().int(1, 8).message(7, &self.body).message(8, &operators).0
    }
}

/// A tensor without data.
pub(crate) fn tensor(name: &str, dims: &[i64], data_type: i64) -> Message {
    dims.iter().fold(Message::default(), |tensor, dim| tensor.int(1, *dim)).int(2, data_type).text(8, name)
}

/// Numbers in `[-0.5, 0.5)`, the same on every run.
pub(crate) fn numbers(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1 << 24) as f32 - 0.5
    };
    (0..count).map(|_| next()).collect()
}
