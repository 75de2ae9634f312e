
// The Chamfer distance of a frame, in both directions, errors (N, K, 2) [m]:
//
//   measured   mean over points of | least over parts of their distance from the part's surface |, NaN without points
//   simulated  mean over vertices of the distance of the nearest point
//
// Balls, LANES of them at once, tell what cannot be nearest; it is skipped, which changes no bit (CULLED 0: nothing is).

// measured to simulated
enum { WORDS = (PARTS + 31) / 32 };
real total = zero, count = zero;
SHARED unsigned near[WORDS][LANES];  // of each ball of a group, a bit for a part
for (int g = first_group; g < last_group; ++g) {
  // which parts can be nearest to a point in a ball: the others are farther by more than its width
  const real x = ROW(balls, g, 0), y = ROW(balls, g, 1), z = ROW(balls, g, 2), ball = ROW(balls, g, 3);
  real lower[PARTS], limit = zero + FAR;
  UNROLL for (int part = 0; part < PARTS; ++part) {
    const real away = to_axis(part, x, y, z);
    const real upper = away * MORE - (surface[RADIUS][part] - surface[OFF][part]);
    lower[part] = away * LESS - (surface[RADIUS][part] + surface[OFF][part]);
    limit = upper < limit ? upper : limit;
  }
  limit += CULLED ? 2.0f * ball : zero + INFINITE;
  whole bits_of_parts[WORDS] = {};
  UNROLL for (int part = 0; part < PARTS; ++part)
    bits_of_parts[part / 32] |= lower[part] > limit ? whole() : whole() + (1u << part % 32);
  SYNC();  // the group before may be read still
  for (int word = 0; word < WORDS; ++word) PUT(near[word], bits_of_parts[word]);
  SYNC();

  const int begin = first + (g - first_group) * LANES;
  const int size = last - begin < LANES ? last - begin : LANES;
  for (int k = 0; k < size; ++k) {
    const int b = begin + k;
    const real x = ROW(points, b, 0), y = ROW(points, b, 1), z = ROW(points, b, 2), weight = ROW(points, b, 3);
    real nearest = zero + FAR;
    for (int word = 0; word < WORDS; ++word)
      for (unsigned bits = near[word][k]; bits; bits &= bits - 1) {
        const real gap = gap_to(32 * word + FIRST_BIT(bits), x, y, z);
        nearest = gap < nearest ? gap : nearest;
      }
    total += weight * (nearest < 0.0f ? -nearest : nearest);
    count += weight;
  }
}
const float measured = sum(total) / sum(count) + broken;

// simulated to measured
for (int part = 0; part < PARTS; ++part) {
  // which blocks can hold the point that is nearest to one of the part's vertices
  auto away_from = [&](int g) -> real { return ROOT(square_to(&surface[MIDDLE][part], ROW(balls, g, 0), ROW(balls, g, 1), ROW(balls, g, 2))); };
  real limits = zero + FAR, nearest[VERTICES];
  for (int g = first_group; g < last_group; ++g) {
    const real upper = away_from(g) * MORE + ROW(balls, g, 3);
    limits = upper < limits ? upper : limits;
  }
  const float limit = least(limits) + (CULLED ? 2.0f * surface[REACH][part] : INFINITE);
  for (int k = 0; k < VERTICES; ++k) nearest[k] = zero + FAR;
  for (int g = first_group; g < last_group; ++g) {
    const int begin = first + (g - first_group) * LANES;
    const unsigned there = last - begin < LANES ? (1u << (last - begin)) - 1 : ~0u;
    for (unsigned bits = BITS(away_from(g) * LESS - ROW(balls, g, 3) <= limit) & there; bits; bits &= bits - 1) {
      const int b = begin + FIRST_BIT(bits);
      const real x = ROW(points, b, 0), y = ROW(points, b, 1), z = ROW(points, b, 2);
      for (int k = 0; k < VERTICES; ++k) {
        const real square = square_to(&surface[VERTEX + 3 * k][part], x, y, z);
        nearest[k] = square < nearest[k] ? square : nearest[k];
      }
    }
  }
  for (int k = 0; k < VERTICES; ++k) {
    const float square = least(nearest[k]);
    if (lane == 0) surface[NEAREST + k][part] = square;
  }
}
for (int part = PARTS + lane; part < WIDE; part += THREADS) {
  surface[WEIGHT][part] = 0.0f;
  for (int k = 0; k < VERTICES; ++k) surface[NEAREST + k][part] = 0.0f;
}
SYNC();
real shares = zero;
for (int part = 0; part < PARTS; part += LANES)
  for (int k = 0; k < VERTICES; ++k) shares += ROOT(GET(surface[NEAREST + k] + part)) * GET(surface[WEIGHT] + part);
const float simulated = sum(shares) / weights + broken;
if (lane == 0) {
  errors.data[2 * (size_t)item] = measured;
  errors.data[2 * (size_t)item + 1] = simulated;
}
