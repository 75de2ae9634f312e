// The terms of one rollout's loss, as loss.py says them: one text for a CPU thread and for a CUDA warp,
// whose 32 threads share its samples and frames. Sums in a fixed order, in double precision.
//
// Wants the macro WINDOW (samples of the median, odd). In: force (N, S, 3), of any strides [N]; the filter
// (T, S) by rows: entries of row t are first[t] to first[t + 1] of columns and values; measured and velocity
// (T, 3); sample_weights (2, T), of a sample's force and of its power; errors (N, K, 2) [m]; frame_weights
// (K,), of geom. Scratch: filtered (N, 3, T). Out: terms (N, 3), in the order of TERMS.

#if defined(__CUDA_ARCH__)
#define THREADS 32
#define SYNC() __syncwarp()
#define ROOT(x) sqrt(x)
auto sum = [](double x) -> double { for (int o = 16; o > 0; o >>= 1) x += __shfl_xor_sync(0xffffffffu, x, o); return x; };
#else
#define THREADS 1
#define SYNC()
#define ROOT(x) __builtin_sqrt(x)
auto sum = [](double x) -> double { return x; };
#endif

const int item = tid / THREADS, lane = tid % THREADS;
const char* forces = (const char*)force.data + (size_t)item * force.strides[0];
double* smooth = filtered.data + (size_t)item * 3 * samples;

// the force on the way of a recorded one
for (int t = 0; t < samples; ++t) {
  double total[3] = {0.0, 0.0, 0.0};
  for (int i = first.data[t] + lane; i < first.data[t + 1]; i += THREADS) {
    const char* step = forces + (size_t)columns.data[i] * force.strides[1];
    for (int c = 0; c < 3; ++c) total[c] += values.data[i] * (double)*(const float*)(step + c * force.strides[2]);
  }
  for (int c = 0; c < 3; ++c) {
    const double whole = sum(total[c]);
    if (lane == 0) smooth[c * samples + t] = whole;
  }
}
SYNC();

auto median = [](const double* x) -> double {
  double found = x[0];  // if all are NaN
  for (int i = 0; i < WINDOW; ++i) {
    int below = 0;
    for (int j = 0; j < WINDOW; ++j) below += x[j] < x[i] || (x[j] == x[i] && j < i);
    found = below == WINDOW / 2 ? x[i] : found;
  }
  return found;
};
double newtons = 0.0, joules = 0.0, geom = 0.0;
for (int t = lane; t < samples; t += THREADS) {
  const double mean = sample_weights.data[t], trapezoid = sample_weights.data[samples + t];
  double square = 0.0, power = 0.0;
  for (int c = 0; c < 3; ++c) {
    double near[WINDOW];
    for (int k = 0; k < WINDOW; ++k) {
      const int at = t + k - WINDOW / 2;
      near[k] = smooth[c * samples + (at < 0 ? 0 : at < samples ? at : samples - 1)];
    }
    const double gap = measured.data[3 * t + c] - median(near);
    square += gap * gap;
    power += gap * velocity.data[3 * t + c];
  }
  if (mean != 0.0) newtons += mean * ROOT(square);  // what weighs nothing may be NaN
  if (trapezoid != 0.0) joules += trapezoid * power;
}
for (int k = lane; k < frames; k += THREADS) {
  const float* pair = errors.data + ((size_t)item * frames + k) * 2;
  const double error = ((double)pair[0] + (double)pair[1]) / 2.0;
  if (frame_weights.data[k] != 0.0) geom += frame_weights.data[k] * error;
}
newtons = sum(newtons); joules = sum(joules); geom = sum(geom);
if (lane == 0) {
  double* out = terms.data + (size_t)item * 3;
  out[0] = geom; out[1] = newtons; out[2] = joules < 0.0 ? -joules : joules;
}
