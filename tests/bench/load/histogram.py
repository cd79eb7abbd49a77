"""Counts of latencies in buckets whose width grows with them, so that any percentile is known to one
part in 64 whatever the range (as G. Tene's HdrHistogram does)."""

SUB_BUCKETS = 64  # in every doubling


def bucket_of(value):
    """Of a whole number >= 0."""
    shift = max(0, value.bit_length() - SUB_BUCKETS.bit_length())
    return shift * SUB_BUCKETS + (value >> shift)


def most_in(bucket):
    """The largest number in it."""
    shift = max(0, bucket // SUB_BUCKETS - 1)
    return ((bucket - shift * SUB_BUCKETS + 1) << shift) - 1


class Histogram:
    """Of seconds, kept in microseconds."""

    def __init__(self):
        self.counts, self.total, self.most = {}, 0, 0

    def add(self, seconds):
        value = max(0, round(1e6 * seconds))
        bucket = bucket_of(value)
        self.counts[bucket] = self.counts.get(bucket, 0) + 1
        self.total += 1
        self.most = max(self.most, value)

    def percentile(self, percent):
        """Seconds that so many percent did not exceed; None of nothing."""
        rank, seen = max(1, -(-self.total * percent // 100)), 0
        for bucket in sorted(self.counts):
            seen += self.counts[bucket]
            if seen >= rank:
                return min(most_in(bucket), self.most) / 1e6
        return None
