//! Identity of a list of partners.

use std::fmt;

use chaic_env::partner_suite::PartnerSuite;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::secret::to_hex;

/// Number and digest of the partners of a list. It discloses nothing else about them.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartnersDigest {
    /// Number of partners.
    pub n: usize,
    /// SHA-256 of `partners.json`, hexadecimal.
    pub sha256: String,
}

impl PartnersDigest {
    /// Returns the number and digest of the partners of a list, without the ordinary partner.
    pub fn new(suite: &PartnerSuite) -> PartnersDigest {
        let sha256 = to_hex(&Sha256::digest(suite.to_json()));
        PartnersDigest { n: suite.partners().len(), sha256 }
    }
}

impl fmt::Display for PartnersDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.n == 1 { "" } else { "s" };
        write!(f, "{} partner{plural} (SHA-256 {})", self.n, self.sha256)
    }
}
