// How slings are laid out over threads; one text for both kinds of device.
//
// A team of T threads steps one sling. On a CPU T is 1 and the thread has W slings in its SIMD lanes (`real`
// is a vector of W numbers). On a GPU `real` is one number, a warp has 32 / T teams, and the threads of a
// team share the work: each has a section to assemble and a column of the blocks to eliminate.
//
// Wants the macros SC (float or double), W, T, L (cross-sections), MID (the held one), N (degrees of freedom of each).

#if defined(__CUDA_ARCH__)
typedef SC real;
#define TEAMS (32 / T)
#define AGAIN 0                                          // whether a factor serves twice: a GPU, which waits, gains nothing
#define COLUMNS 1                                        // columns of a block that a thread has, the residual's too
#define OWN_ROWS 1                                       // rows of the solution that it has
const int lane = tid % 32, team = lane / T < TEAMS ? lane / T : TEAMS - 1;
const int sling = tid / 32 * TEAMS + team;
const int member = lane < TEAMS * T ? lane - team * T : 1000;  // spare threads find no work
#define ROW(array, size) (array.data + (size_t)sling * (size))
#define SAVE (work.data + (size_t)(tid / 32) * (L * SAVED) * 32 + lane)
#define SAVE_STRIDE 32
#define FIRST_COLUMN (lane - team * T)
#define OF(array, k, m) __shfl_sync(~0u, array[0][m], team * T + (k))  // row m of column k
#define AT_MEMBER(array, k) __shfl_sync(~0u, array[0], team * T + (k))
#define SYNC __syncwarp()
#define ALL(mask) __all_sync(~0u, mask)
#define SQRT(x) sqrt(x)
#define UNROLL _Pragma("unroll")
#define FIRST_ROW(c) 0                                   // a block's columns are whole; on a CPU, from the diagonal
auto team_maximum = [&](real x) -> real {
  for (int reach = 1; reach < T; reach *= 2) {
    const real other = __shfl_sync(~0u, x, team * T + (member + reach) % T);
    x = x > other ? x : other;
  }
  return x;
};
#else
typedef SC real __attribute__((vector_size(sizeof(SC) * W)));
#define COLUMNS (N + 1)
#define AGAIN 1
#define OWN_ROWS N
const int sling = tid, member = 0;
#define ROW(array, size) ((real*)array.data + (size_t)sling * (size))
#define SAVE ((real*)work.data + (size_t)sling * (L * SAVED) * COLUMNS)
#define SAVE_STRIDE COLUMNS
#define FIRST_COLUMN 0
#define OF(array, k, m) array[k][m]
#define AT_MEMBER(array, k) array[k]
#define SYNC
auto all_lanes = [](auto mask) -> bool { bool all = true; for (int k = 0; k < W; ++k) all &= (mask[k] != 0); return all; };
auto root = [](real x) -> real { real y; for (int k = 0; k < W; ++k) y[k] = __builtin_sqrt(x[k]); return y; };
#define ALL(mask) all_lanes(mask)
#define SQRT(x) root(x)
#if N > 9
#define UNROLL                                           // it would take minutes to compile
#else
#define UNROLL _Pragma("clang loop unroll(full)")
#endif
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
