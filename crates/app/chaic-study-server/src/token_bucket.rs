//! Rate limit by a token bucket. Time is a parameter.

use crate::limits::RateLimit;

/// State of a rate limit.
#[derive(Clone, Debug)]
pub struct TokenBucket {
    rate: RateLimit,
    tokens: u64,
    at_secs: u64,
}

impl TokenBucket {
    /// Creates a full bucket.
    pub fn new(rate: RateLimit, now_secs: u64) -> TokenBucket {
        TokenBucket { rate, tokens: rate.burst, at_secs: now_secs }
    }

    /// Takes a token; returns false if there is none.
    pub fn take(&mut self, now_secs: u64) -> bool {
        let elapsed_secs = now_secs.saturating_sub(self.at_secs);
        let added = elapsed_secs.saturating_mul(self.rate.per_sec);
        self.tokens = self.tokens.saturating_add(added).min(self.rate.burst);
        self.at_secs = self.at_secs.max(now_secs);
        let is_left = self.tokens > 0;
        self.tokens = self.tokens.saturating_sub(1);
        is_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_gives_its_burst_and_then_its_rate() {
        let mut bucket = TokenBucket::new(RateLimit { burst: 3, per_sec: 2 }, 10);
        let mut taken = |now_secs| (0..9).filter(|_| bucket.take(now_secs)).count();
        assert_eq!([taken(10), taken(10), taken(11), taken(99), taken(98)], [3, 0, 2, 3, 0]);
    }
}
