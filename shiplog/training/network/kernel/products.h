// Matrix products in register tiles. Included once for each instruction set, inside its namespace.
//
// LANE_BYTES  bytes of a vector register
// ROWS        rows of a tile; ROWS x 2 vectors of sums stay in registers
//
// Every loop over a tile must be unrolled, else the compiler keeps the sums in memory.

template <class T> struct VectorOf;
template <> struct VectorOf<float> {
  typedef float type __attribute__((vector_size(LANE_BYTES)));
};
template <> struct VectorOf<double> {
  typedef double type __attribute__((vector_size(LANE_BYTES)));
};
template <class T> using Vector = typename VectorOf<T>::type;
template <class T> constexpr int64_t LANES = LANE_BYTES / sizeof(T);
template <class T> constexpr int64_t PANEL = 2 * LANES<T>;  // columns of a tile

template <class T> constexpr int64_t padded(int64_t n) {
  return (n + PANEL<T> - 1) / PANEL<T> * PANEL<T>;
}
inline int64_t tiled(int64_t n) { return (n + ROWS - 1) / ROWS * ROWS; }

template <class T> inline Vector<T> load(const T* from) {
  return *reinterpret_cast<const Vector<T>*>(from);
}
template <class T> inline void store(T* to, Vector<T> v) { *reinterpret_cast<Vector<T>*>(to) = v; }
template <class T> inline Vector<T> all(T x) { return x - Vector<T>{}; }

// A rational minimax fit of tanh on [-9, 9], odd, relative error 2e-8 before rounding; beyond 9
// tanh is 1 in float32. Not-a-number stays what it is.
inline Vector<float> tanh_of(Vector<float> x) {
  const Vector<float> top = all(9.0f);
  x = x > top ? top : x;
  x = x < -top ? -top : x;
  const Vector<float> y = x * x;
  Vector<float> p = 1.335462717e-08f * y + 2.060905586e-05f;
  p = p * y + 3.495586451e-03f;
  p = p * y + 1.338102421e-01f;
  p = p * y + 9.999999795e-01f;
  Vector<float> q = 7.776543757e-07f * y + 3.285632123e-04f;
  q = q * y + 2.587697576e-02f;
  q = q * y + 4.671433981e-01f;
  q = q * y + 1.0f;
  return x * p / q;
}
inline Vector<double> tanh_of(Vector<double> x) {
  for (int64_t i = 0; i < LANES<double>; ++i) x[i] = std::tanh(x[i]);
  return x;
}

// sums[r] += a[r, :k] b, b a packed panel [k, PANEL]. Rows of `a` are `stride` apart; three rows
// share a pointer, which x86 addresses without further arithmetic.
template <class T, int R>
inline void multiply(const T* a, int64_t stride, const T* b, int64_t k, Vector<T> (&sums)[R][2]) {
  for (int64_t i = 0; i < k; ++i, ++a, b += PANEL<T>) {
    const Vector<T> left = load(b), right = load(b + LANES<T>);
#pragma GCC unroll 16
    for (int r = 0; r < R; ++r) {
      const Vector<T> x = all(a[r * stride]);
      sums[r][0] += x * left;
      sums[r][1] += x * right;
    }
  }
}

// What becomes of the sums of a layer, forward and backward.
enum class Then { tanh, slope };

template <class T, int R, Then then>
inline void tile(const T* a, int64_t a_stride, const T* b, int64_t k, const T* with,
                 int64_t with_stride, T* out, int64_t out_stride) {
  Vector<T> sums[R][2];
#pragma GCC unroll 16
  for (int r = 0; r < R; ++r)
    for (int v = 0; v < 2; ++v)
      sums[r][v] = then == Then::tanh ? load(with + v * LANES<T>) : Vector<T>{};
  multiply<T, R>(a, a_stride, b, k, sums);
#pragma GCC unroll 16
  for (int r = 0; r < R; ++r)
    for (int v = 0; v < 2; ++v) {
      Vector<T> s = sums[r][v];
      if (then == Then::tanh) {
        s = tanh_of(s);
      } else {
        const Vector<T> h = load(with + r * with_stride + v * LANES<T>);
        s = s * (T(1) - h * h);
      }
      store(out + r * out_stride + v * LANES<T>, s);
    }
}

// One panel of a layer for `rows` rows of a, at most ROWS.
template <class T, Then then, int R = ROWS>
inline void tile_of(int64_t rows, const T* a, int64_t a_stride, const T* b, int64_t k,
                    const T* with, int64_t with_stride, T* out, int64_t out_stride) {
  if constexpr (R > 1) {
    if (rows < R)
      return tile_of<T, then, R - 1>(rows, a, a_stride, b, k, with, with_stride, out, out_stride);
  }
  tile<T, R, then>(a, a_stride, b, k, with, with_stride, out, out_stride);
}

// out [n, panels * PANEL] = tanh(bias + a W)         (Then::tanh, `with` the bias)
//                         = (a W) (1 - h^2)          (Then::slope, `with` h [n, with_stride])
// for a [n, k] and W packed in panels.
template <class T, Then then>
void layer(int64_t n, const T* a, int64_t a_stride, const T* packed, int64_t k, int64_t panels,
           const T* with, int64_t with_stride, T* out, int64_t out_stride) {
  const int64_t pieces = (n + ROWS - 1) / ROWS;
  for (int64_t p = 0; p < panels; ++p) {
    const int64_t column = p * PANEL<T>;
    for (int64_t piece = 0; piece < pieces; ++piece) {
      const int64_t from = n * piece / pieces, rows = n * (piece + 1) / pieces - from;
      const int64_t at = then == Then::tanh ? 0 : from * with_stride;
      tile_of<T, then>(rows, a + from * a_stride, a_stride, packed + p * k * PANEL<T>, k,
                       with + at + column, with_stride, out + from * out_stride + column,
                       out_stride);
    }
  }
}

// y [n, 3] = a [n, k] w^T, w [3, k]; k a multiple of PANEL, rows of w `k` apart.
template <class T> void three(int64_t n, const T* a, int64_t stride, const T* w, int64_t k, T* y) {
  for (int64_t row = 0; row < n; ++row, a += stride, y += 3) {
    Vector<T> sums[3][2] = {};
    for (int64_t i = 0; i < k; i += PANEL<T>)
#pragma GCC unroll 3
      for (int o = 0; o < 3; ++o) {
        sums[o][0] += load(a + i) * load(w + o * k + i);
        sums[o][1] += load(a + i + LANES<T>) * load(w + o * k + i + LANES<T>);
      }
    for (int o = 0; o < 3; ++o) {
      const Vector<T> both = sums[o][0] + sums[o][1];
      T sum = 0;
      for (int64_t i = 0; i < LANES<T>; ++i) sum += both[i];
      y[o] = sum;
    }
  }
}

// g [tiles * ROWS, panels * PANEL] += left^T right over m rows. left is packed [tile, m, ROWS],
// right [panel, m, PANEL].
template <class T>
void add_outer(int64_t m, const T* left, int64_t tiles, const T* right, int64_t panels, T* g) {
  const int64_t stride = panels * PANEL<T>;
  for (int64_t p = 0; p < panels; ++p)
    for (int64_t t = 0; t < tiles; ++t) {
      T* to = g + t * ROWS * stride + p * PANEL<T>;
      const T *a = left + t * m * ROWS, *b = right + p * m * PANEL<T>;
      Vector<T> sums[ROWS][2];
#pragma GCC unroll 16
      for (int r = 0; r < ROWS; ++r)
        for (int v = 0; v < 2; ++v) sums[r][v] = load(to + r * stride + v * LANES<T>);
      for (int64_t i = 0; i < m; ++i, a += ROWS, b += PANEL<T>) {
        const Vector<T> x = load(b), y = load(b + LANES<T>);
#pragma GCC unroll 16
        for (int r = 0; r < ROWS; ++r) {
          const Vector<T> d = all(a[r]);
          sums[r][0] += d * x;
          sums[r][1] += d * y;
        }
      }
#pragma GCC unroll 16
      for (int r = 0; r < ROWS; ++r)
        for (int v = 0; v < 2; ++v) store(to + r * stride + v * LANES<T>, sums[r][v]);
    }
}

// a [m, n], rows `stride` apart, into tiles of ROWS columns: [tile, m, ROWS], the last one filled
// up with zeros.
template <class T> void pack_tiles(int64_t m, int64_t n, const T* a, int64_t stride, T* packed) {
  for (int64_t from = 0; from < n; from += ROWS) {
    const int64_t columns = std::min<int64_t>(ROWS, n - from);
    for (int64_t i = 0; i < m; ++i, packed += ROWS)
      for (int64_t c = 0; c < ROWS; ++c)
        packed[c] = c < columns ? a[i * stride + from + c] : T(0);
  }
}

// a [m, panels * PANEL], rows `stride` apart, into [panel, m, PANEL].
template <class T>
void pack_panels(int64_t m, int64_t panels, const T* a, int64_t stride, T* packed) {
  for (int64_t p = 0; p < panels; ++p)
    for (int64_t i = 0; i < m; ++i, packed += PANEL<T>) {
      const T* from = a + i * stride + p * PANEL<T>;
      store(packed, load(from));
      store(packed + LANES<T>, load(from + LANES<T>));
    }
}
