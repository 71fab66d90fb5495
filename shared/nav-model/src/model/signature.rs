//! The owner's signature under a manifest: who made a model, besides what it says.
//!
//! The manifest holds the hash of every other file that is loaded, so that a minisign signature of the manifest alone
//! (`manifest.json.minisig` beside it) is one of the whole model.

use minisign_verify::{Error, PublicKey, Signature};
use nav_core::manifest::{MANIFEST_FILE, SIGNATURE_FILE};
use std::path::{Path, PathBuf};

use crate::load::{FileError, read_file_in, read_named_file};

/// The largest key or signature that is read, bytes.
const MAX_BYTES: u64 = 4 << 10;

/// The public key of whoever may make models for a robot.
#[derive(Clone, Debug)]
pub struct OwnerKey(PublicKey);

/// Why a model is not known to be the owner's.
#[derive(Debug, thiserror::Error)]
pub enum SignatureError {
    /// The key cannot be used.
    #[error(
        "`{given}` is no minisign public key ({problem}): give the path of a .pub file, or the 56 characters in its \
         second line"
    )]
    Key {
        /// As it was given.
        given: String,
        /// Why not.
        problem: String,
    },
    /// There is no signature.
    #[error(
        "the model is not signed, and a signature is required: {} cannot be read ({problem}); whoever answers for the \
         model makes it with `minisign -S -m {MANIFEST_FILE}`",
        path.display()
    )]
    None {
        /// Where it should be.
        path: PathBuf,
        /// Why it was not read.
        problem: String,
    },
    /// The signature is not one that minisign writes now.
    #[error(
        "{} is damaged or of an old kind ({problem}); sign {MANIFEST_FILE} again with minisign 0.10 or later",
        path.display()
    )]
    Unreadable {
        /// The signature.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// Somebody else signed it.
    #[error(
        "{} was made with another key than the required one; do not drive with this model unless its maker is known, \
         and then require their key",
        path.display()
    )]
    OtherKey {
        /// The signature.
        path: PathBuf,
    },
    /// The key is right, the manifest is not what was signed.
    #[error(
        "{} is not a signature of the manifest beside it: one of the two was changed or replaced; copy the folder \
         again, or look at what was changed and sign it anew",
        path.display()
    )]
    Changed {
        /// The signature.
        path: PathBuf,
    },
}

impl OwnerKey {
    /// A key from its 56 characters, or from the file of that name.
    ///
    /// # Errors
    /// Neither of both.
    pub fn read(given: &str) -> Result<Self, SignatureError> {
        if let Ok(key) = PublicKey::from_base64(given) {
            return Ok(Self(key));
        }
        let refuse = |problem: String| SignatureError::Key { given: given.to_owned(), problem };
        let file = read_named_file(Path::new(given), MAX_BYTES).map_err(|error| refuse(words(error)))?;
        let text = String::from_utf8(file.bytes).map_err(|error| refuse(error.to_string()))?;
        // With its comment, as minisign writes it, or the key alone.
        let key = PublicKey::decode(&text).or_else(|_| PublicKey::from_base64(text.trim()));
        Ok(Self(key.map_err(|error| refuse(error.to_string()))?))
    }

    /// Whether this key's signature of exactly these bytes lies in the folder.
    ///
    /// # Errors
    /// No signature, another key's, or one of another manifest.
    pub(super) fn check(&self, folder: &Path, manifest: &[u8]) -> Result<(), SignatureError> {
        let path = folder.join(SIGNATURE_FILE);
        let file = match read_file_in(folder, SIGNATURE_FILE, MAX_BYTES) {
            Ok(file) => file,
            Err(error) => return Err(SignatureError::None { path, problem: words(error) }),
        };
        let decoded = String::from_utf8(file.bytes).map_err(|_| Error::InvalidEncoding);
        let checked = decoded
            .and_then(|text| Signature::decode(&text))
            .and_then(|signature| self.0.verify(manifest, &signature, false));
        checked.map_err(|error| match error {
            Error::UnexpectedKeyId => SignatureError::OtherKey { path },
            Error::InvalidSignature => SignatureError::Changed { path },
            other => SignatureError::Unreadable { path, problem: other.to_string() },
        })
    }
}

/// What the system said, where a file could not be read.
fn words(error: FileError) -> String {
    match error {
        FileError::Io { source, .. } => source.to_string(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use minisign::{KeyPair, sign};
    use std::io::Cursor;

    fn pair() -> KeyPair {
        KeyPair::generate_unencrypted_keypair().expect("a key pair")
    }

    /// A folder that holds a signature by `pair` of `manifest`.
    fn signed(pair: &KeyPair, manifest: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let signature =
            sign(Some(&pair.pk), &pair.sk, Cursor::new(manifest), Some("a model"), None).expect("signed");
        std::fs::write(folder.path().join("manifest.json.minisig"), signature.to_string()).expect("written");
        folder
    }

    fn key(pair: &KeyPair) -> OwnerKey {
        OwnerKey::read(&pair.pk.to_base64()).expect("a key")
    }

    #[test]
    fn the_owner_s_signature_of_the_very_bytes_is_accepted_and_no_other() {
        let (owner, other) = (pair(), pair());
        let folder = signed(&owner, "manifest");
        let path = folder.path();
        assert!(key(&owner).check(path, b"manifest").is_ok());
        let refused = |key: &OwnerKey, bytes: &[u8]| key.check(path, bytes).expect_err("refused");
        assert!(matches!(refused(&key(&owner), b"manifesT"), SignatureError::Changed { .. }));
        assert!(matches!(refused(&key(&other), b"manifest"), SignatureError::OtherKey { .. }));
        let file = path.join("manifest.json.minisig");
        let whole = std::fs::read_to_string(&file).expect("text");
        // What the trusted comment says is signed, too.
        std::fs::write(&file, whole.replace("a model", "any model")).expect("written");
        assert!(matches!(refused(&key(&owner), b"manifest"), SignatureError::Changed { .. }));
        for damaged in ["", "nothing", &whole[..whole.len() / 2], "\u{0}\n\u{0}\n\u{0}\n\u{0}\n"] {
            std::fs::write(&file, damaged).expect("written");
            assert!(matches!(refused(&key(&owner), b"manifest"), SignatureError::Unreadable { .. }));
        }
        std::fs::write(&file, vec![b'x'; 5000]).expect("written");
        let long = refused(&key(&owner), b"manifest").to_string();
        assert!(long.contains("larger than 4096 bytes"), "{long}");
        std::fs::remove_file(&file).expect("removed");
        assert!(matches!(refused(&key(&owner), b"manifest"), SignatureError::None { .. }));
    }

    /// Made by minisign 0.9, which signed the bytes themselves; from the tests of minisign-verify.
    #[test]
    fn a_signature_of_the_old_kind_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let old = "untrusted comment: signature from minisign secret key\n\
             RWQf6LRCGA9i59SLOFxz6NxvASXDJeRtuZykwQepbDEGt87ig1BNpWaVWuNrm73YiIiJbq71Wi+dP9eKL8OC351vwIasSSbXxwA=\n\
             trusted comment: timestamp:1555779966\tfile:test\n\
             QtKMXWyYcwdpZAlPF7tE2ENJkRd1ujvKjlj1m9RtHTBnZPa5WKU5uWRs5GoP5M/VqE81QFuMKI5k/SfNQUaOAA==\n";
        std::fs::write(folder.path().join("manifest.json.minisig"), old).expect("written");
        let key = OwnerKey::read("RWQf6LRCGA9i53mlYecO4IzT51TGPpvWucNSCh1CBM0QTaLn73Y7GFO3").expect("a key");
        let error = key.check(folder.path(), b"test").expect_err("old").to_string();
        assert!(error.contains("of an old kind"), "{error}");
    }

    #[test]
    fn a_key_is_read_from_its_characters_or_from_a_file() {
        let pair = pair();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, signed) = (folder.path().join("owner.pub"), signed(&pair, "manifest"));
        let text = file.to_str().expect("a plain path");
        let boxed = pair.pk.to_box().expect("a box").to_string();
        for content in [boxed, pair.pk.to_base64() + "\n"] {
            std::fs::write(&file, content).expect("written");
            assert!(OwnerKey::read(text).expect("a key").check(signed.path(), b"manifest").is_ok());
        }
        std::os::unix::fs::symlink("owner.pub", folder.path().join("link.pub")).expect("linked");
        let link = folder.path().join("link.pub");
        assert!(OwnerKey::read(link.to_str().expect("a plain path")).is_ok(), "as a mounted volume has it");
        for content in ["", "untrusted comment: a key\n", "untrusted comment: a key\nRWQf6LRC\n"] {
            std::fs::write(&file, content).expect("written");
            assert!(matches!(OwnerKey::read(text), Err(SignatureError::Key { .. })), "{content}");
        }
        for wrong in ["RWQf6LRC", "/dev/zero", "/absent/owner.pub", ".", "/"] {
            let error = OwnerKey::read(wrong).expect_err(wrong).to_string();
            assert!(error.contains(wrong) && error.contains(".pub file"), "{error}");
        }
    }
}
