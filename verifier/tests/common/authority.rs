//! A time-stamping authority for tests: openssl, which has nothing in common with what verifies.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};
use tempfile::TempDir;

/// What certificate the authority signs with.
#[derive(Clone, Copy, PartialEq)]
pub enum Certificate {
    /// One that is right, of an elliptic curve.
    Right,
    /// One that is right, RSA, named by SHA-1 as older authorities do.
    OldRsa,
    /// One whose time was over years ago.
    Expired,
    /// One for web servers.
    OfServer,
    /// One whose purpose is not marked as critical.
    NotCritical,
}

pub struct Authority {
    folder: TempDir,
    certificate: Certificate,
}

const CONFIGURATION: &str = "
[tsa]
default_tsa = one
[one]
serial = serial
signer_digest = sha256
default_policy = 1.2.3.4.1
digests = sha256, sha384, sha512
accuracy = secs:1, millisecs:500
clock_precision_digits = 3
ordering = yes
tsa_name = yes
ess_cert_id_alg = ESS_ALGORITHM

[ca]
default_ca = issuer
[issuer]
new_certs_dir = .
database = index.txt
rand_serial = yes
default_md = sha256
policy = any
[any]
commonName = supplied

[req]
distinguished_name = name
[name]
[root]
basicConstraints = critical, CA:TRUE
keyUsage = critical, keyCertSign, cRLSign
[stamps]
keyUsage = critical, digitalSignature
extendedKeyUsage = critical, timeStamping
[not_critical]
extendedKeyUsage = timeStamping
[server]
extendedKeyUsage = critical, serverAuth
";

impl Authority {
    pub fn new(certificate: Certificate) -> Self {
        let authority = Authority { folder: tempfile::tempdir().unwrap(), certificate };
        let old = certificate == Certificate::OldRsa;
        let configuration = CONFIGURATION.replace("ESS_ALGORITHM", if old { "sha1" } else { "sha256" });
        fs::write(authority.path("openssl.cnf"), configuration).unwrap();
        fs::write(authority.path("index.txt"), "").unwrap();
        fs::write(authority.path("serial"), "01\n").unwrap();
        let extensions = match certificate {
            Certificate::OfServer => "server",
            Certificate::NotCritical => "not_critical",
            _ => "stamps",
        };
        let period = match certificate {
            Certificate::Expired => "-startdate 20150101000000Z -enddate 20160101000000Z",
            _ => "-days 3650",
        };
        let [root_key, own_key] = match old {
            true => ["rsa:2048"; 2],
            false => ["ec -pkeyopt ec_paramgen_curve:P-256"; 2],
        };
        authority.openssl(&format!(
            "req -x509 -config openssl.cnf -extensions root -newkey {root_key} -nodes -keyout root.key -out root.pem -days 3650 \
             -subj /CN=Root"
        ));
        authority.openssl(&format!(
            "req -config openssl.cnf -newkey {own_key} -nodes -keyout own.key -out own.csr -subj /CN=Authority"
        ));
        authority.openssl(&format!(
            "ca -batch -config openssl.cnf -cert root.pem -keyfile root.key -in own.csr -out own.pem -notext {period} \
             -extfile openssl.cnf -extensions {extensions}"
        ));
        authority
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The certificate that vouches for the authority.
    pub fn root(&self) -> PathBuf {
        self.path("root.pem")
    }

    /// Answers a request.
    pub fn answer(&self, request: &Path, response: &Path) {
        if matches!(self.certificate, Certificate::OfServer | Certificate::NotCritical) {
            return self.answer_for_another_purpose(request, response);
        }
        self.openssl(&format!(
            "ts -reply -config openssl.cnf -queryfile {} -signer own.pem -inkey own.key -out {}",
            request.display(),
            response.display()
        ));
    }

    /// openssl signs no time stamp with a certificate for another purpose, but any other message: that
    /// of a right authority, in this case.
    fn answer_for_another_purpose(&self, request: &Path, response: &Path) {
        let right = Authority::new(Certificate::Right);
        right.answer(request, &self.path("right.tsr"));
        self.openssl("ts -reply -in right.tsr -token_out -out right.token");
        self.openssl("cms -verify -noverify -inform DER -in right.token -binary -out content");
        self.openssl(
            "cms -sign -cades -binary -nodetach -econtent_type 1.2.840.113549.1.9.16.1.4 -in content -signer own.pem -inkey \
             own.key -outform DER -out token",
        );
        let granted = [0x30, 3, 2, 1, 0];
        let token = fs::read(self.path("token")).unwrap();
        let length = u16::try_from(granted.len() + token.len()).unwrap().to_be_bytes();
        fs::write(response, [&[0x30, 0x82], &length[..], &granted, &token].concat()).unwrap();
    }

    /// Makes a request of its own, as another program would.
    pub fn request(&self, file: &Path, options: &str, request: &Path) {
        let (file, request) = (file.display(), request.display());
        self.openssl(&format!("ts -query -data {file} {options} -cert -out {request}"));
    }

    fn openssl(&self, arguments: &str) {
        let mut command = Command::new("openssl");
        command.current_dir(self.folder.path()).env("OPENSSL_CONF", self.path("openssl.cnf"));
        let output = command.args(arguments.split_whitespace()).output().unwrap();
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
