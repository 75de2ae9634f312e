// How slings are laid out over threads; one text for both kinds of device.
//
// On a CPU a thread steps W slings in its SIMD lanes: `real` is a vector of W numbers. On a GPU `real` is one number, and
// the T = 32 threads of a warp share a sling: each has sections to assemble, and two chains of N + 1 threads, a column
// of the blocks each, eliminate from both ends to the middle.
//
// Wants the macros SC (float or double), W, L (cross-sections), MID (the held one), N (degrees of freedom of each).

#if defined(__CUDA_ARCH__)
typedef SC real;
#define T 32
#define CHAINS 2
#define AGAIN 0                                          // whether a factor serves twice: a GPU, which waits, gains nothing
#define COLUMNS 1                                        // columns of a block that a thread has, the residual's too
#define OWN_ROWS 1                                       // rows of the solution that it has
const int sling = tid / T, member = tid % T;
const int chain = member > N, first = chain * (N + 1);   // its first thread
const int mine = member - first;                         // my column; of spare threads more than N
const bool down = chain;                                 // from the last section
#define ROW(array, size) (array.data + (size_t)sling * (size))
#define SAVE (work.data + (size_t)sling * ((LAST + 1) * SAVED) * T + member)
#define SAVE_STRIDE T
#define OF(array, k, m) __shfl_sync(~0u, array[0][m], first + (k))  // row m of column k
#define AT_MEMBER(array, k) __shfl_sync(~0u, array[0], first + (k))
#define SYNC __syncwarp()
#define ALL(mask) __all_sync(~0u, mask)
#define SQRT(x) sqrt(x)
#define UNROLL _Pragma("unroll")
#define FIRST_ROW(c) 0                                   // a block's columns are whole; on a CPU, from the diagonal
auto team_maximum = [](real x) -> real {
  for (int reach = 1; reach < T; reach *= 2) {
    const real other = __shfl_xor_sync(~0u, x, reach);
    x = x > other ? x : other;
  }
  return x;
};
#else
typedef SC real __attribute__((vector_size(sizeof(SC) * W)));
#define T 1
#define CHAINS 1
#define AGAIN 1
#define COLUMNS (N + 1)
#define OWN_ROWS N
const int sling = tid, member = 0, mine = 0;
const bool down = false;
#define ROW(array, size) ((real*)array.data + (size_t)sling * (size))
#define SAVE ((real*)work.data + (size_t)sling * (L * SAVED) * COLUMNS)
#define SAVE_STRIDE COLUMNS
#define OF(array, k, m) array[k][m]
#define AT_MEMBER(array, k) array[k]
#define SYNC
auto all_lanes = [](auto mask) -> bool { bool all = true; for (int k = 0; k < W; ++k) all &= (mask[k] != 0); return all; };
auto root = [](real x) -> real { real y; for (int k = 0; k < W; ++k) y[k] = __builtin_sqrt(x[k]); return y; };
#define ALL(mask) all_lanes(mask)
#define SQRT(x) root(x)
#define UNROLL _Pragma("clang loop unroll(full)")
#define FIRST_ROW(c) (c)
auto team_maximum = [](real x) -> real { return x; };
#endif

const real zero = real() * (SC)0, one = zero + (SC)1;
auto maximum = [](real x, real y) -> real { return x > y ? x : y; };
auto minimum = [](real x, real y) -> real { return x < y ? x : y; };
auto magnitude = [&](real x) -> real { return x < zero ? -x : x; };
auto dot = [](const real* x, const real* y) -> real { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
auto cross = [](const real* x, const real* y, real* z) {
  z[0] = x[1] * y[2] - x[2] * y[1]; z[1] = x[2] * y[0] - x[0] * y[2]; z[2] = x[0] * y[1] - x[1] * y[0]; };
