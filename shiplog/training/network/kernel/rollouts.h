// Rollouts by explicit Euler, Eq. 9 of the paper, their loss, Eq. 8, and its gradient. Included once
// for each instruction set, after products.h.
//
// Windows go in chunks; chunks go to at most GROUPS groups with a gradient of their own, which are
// added in order. Neither depends on the threads.

constexpr int64_t CHUNK = 24;  // windows: the weights are read once for all of them in a step
constexpr int64_t GROUPS = 4;  // gradients that are summed apart
constexpr int64_t FLUSH = 96;  // rows of deltas that become one product

// Weights as the products want them, shared by all groups.
template <class T> struct Packed {
  int64_t depth, inputs, wide, panels, stride;  // of the inputs: padded with a one for the bias
  std::vector<Memory<T>> forward, backward, bias;  // backward[0] is unused
  Memory<T> out, from_velocity;                   // [3, wide]

  explicit Packed(const Network<T>& net)
      : depth(net.depth), inputs(net.inputs), wide(padded<T>(net.width)),
        panels(wide / PANEL<T>), stride(net.inputs + 1) {
    for (int64_t l = 0; l < depth; ++l) {
      const int64_t k = l ? net.width : inputs;
      const T* w = net.weights[2 * l];
      forward.emplace_back(wide * k);
      T* to = forward.back().data;
      for (int64_t p = 0; p < panels; ++p)
        for (int64_t c = 0; c < PANEL<T>; ++c) {
          const int64_t n = p * PANEL<T> + c;
          for (int64_t i = 0; i < k; ++i)
            to[(p * k + i) * PANEL<T> + c] = n < net.width ? w[n * k + i] : T(0);
        }
      bias.emplace_back(wide);
      for (int64_t n = 0; n < wide; ++n)
        bias.back().data[n] = n < net.width ? net.weights[2 * l + 1][n] : T(0);
    }
    for (int64_t l = 0; l <= depth; ++l) {
      const int64_t rows = l < depth ? net.width : 3;
      backward.emplace_back(l ? wide * rows : 0);
      const T* w = net.weights[2 * l];
      for (int64_t p = 0; l && p < panels; ++p)
        for (int64_t n = 0; n < rows; ++n)
          for (int64_t c = 0; c < PANEL<T>; ++c) {
            const int64_t i = p * PANEL<T> + c;
            backward.back().data[(p * rows + n) * PANEL<T> + c] =
                i < net.width ? w[n * net.width + i] : T(0);
          }
    }
    out = Memory<T>(3 * wide);
    from_velocity = Memory<T>(3 * wide);
    for (int64_t o = 0; o < 3; ++o)
      for (int64_t n = 0; n < wide; ++n) {
        const bool real = n < net.width;
        out.data[o * wide + n] = real ? net.weights[2 * depth][o * net.width + n] : T(0);
        from_velocity.data[o * wide + n] = real ? net.weights[0][n * inputs + o] : T(0);
      }
  }
};

// What one group of chunks needs: a chunk's path and activations, and the group's gradient.
template <class T> struct Space {
  const Network<T>& net;
  const Packed<T>& packed;
  const int64_t steps, most;  // Euler steps, windows of the largest chunk
  const int64_t flush;        // steps between two products for the weights' gradient
  bool slope;
  Memory<T> input, hidden, error, delta, last, tiles, right;
  std::vector<Memory<T>> gradient;  // [0] [inputs + 1, wide]; hidden [width, wide]; last [3, wide]
  std::vector<Memory<T>> bias;      // of hidden layers but the first, and of the last
  double loss = 0.0;

  Space(const Network<T>& net_, const Packed<T>& packed_, int64_t steps_, int64_t most_, bool slope_)
      : net(net_), packed(packed_), steps(steps_), most(most_),
        flush(std::max<int64_t>(1, FLUSH / most_)), slope(slope_) {
    const int64_t kept = slope ? steps : 1, wide = packed.wide;
    input = Memory<T>(kept * most * packed.stride);
    hidden = Memory<T>(kept * net.depth * most * wide);
    error = Memory<T>((steps + 1) * most * 3);
    if (!slope) return;
    const int64_t m = flush * most;
    delta = Memory<T>(net.depth * m * wide);
    last = Memory<T>(m * 3);
    tiles = Memory<T>(m * tiled(std::max(net.width, packed.stride)));
    right = Memory<T>(m * std::max(wide, packed.stride));
    for (int64_t l = 0; l <= net.depth; ++l) {
      const int64_t rows = l == 0 ? packed.stride : l < net.depth ? net.width : 3;
      gradient.emplace_back(tiled(rows) * wide);
      gradient.back().clear();
      bias.emplace_back(l == 0 ? 0 : l < net.depth ? wide : 3);
      bias.back().clear();
    }
  }

  T* hidden_at(int64_t layer, int64_t step) {
    return hidden.data + ((slope ? step : 0) * net.depth + layer) * most * packed.wide;
  }
  T* input_at(int64_t step) { return input.data + (slope ? step : 0) * most * packed.stride; }

  // One chunk of n windows, the first one `first`.
  void add(const Windows<T>& data, int64_t first, int64_t n) {
    forward(data, first, n);
    if (slope) backward(data, first, n);
  }

  void forward(const Windows<T>& data, int64_t first, int64_t n) {
    const int64_t wide = packed.wide, stride = packed.stride, driven = net.inputs - 3;
    T velocity[CHUNK * 3], rate[CHUNK * 3];
    std::copy_n(data.velocity + first * 3, n * 3, velocity);
    std::fill_n(error.data, n * 3, T(0));
    for (int64_t k = 0; k < steps; ++k) {
      T* x = input_at(k);
      const T* drive = data.driven + (k * data.count + first) * driven;
      for (int64_t row = 0; row < n; ++row, x += stride) {
        for (int64_t i = 0; i < 3; ++i) {
          const T z = (velocity[row * 3 + i] - net.input_mean[i]) / net.input_std[i];
          x[i] = net.input_tanh ? std::tanh(z) : z;
        }
        std::copy_n(drive + row * driven, driven, x + 3);
        x[net.inputs] = T(1);
      }
      const T* a = input_at(k);
      for (int64_t l = 0; l < net.depth; ++l) {
        T* h = hidden_at(l, k);
        layer<T, Then::tanh>(n, a, l ? wide : stride, packed.forward[l].data,
                             l ? net.width : net.inputs, packed.panels, packed.bias[l].data, 0, h,
                             wide);
        a = h;
      }
      three(n, a, wide, packed.out.data, wide, rate);
      const T *dt = data.dt + k * data.count + first, *b = net.weights[2 * net.depth + 1];
      const T* measured = data.velocity + ((k + 1) * data.count + first) * 3;
      T* e = error.data + (k + 1) * most * 3;
      for (int64_t row = 0; row < n; ++row)
        for (int64_t i = 0; i < 3; ++i) {
          const int64_t at = row * 3 + i;
          velocity[at] +=
              dt[row] * ((rate[at] + b[i]) * net.output_std[i] + net.output_mean[i]);
          e[at] = velocity[at] - measured[at];
          // the trapezoidal rule: half of the interval before, half of the one after
          const T after = k + 1 < steps ? dt[data.count + row] : T(0);
          const T weighted = e[at] * net.error_weights[i] * (T(0.5) * (dt[row] + after));
          loss += double(weighted) * double(e[at]);
          e[at] = weighted * (T(2) / T(data.count));  // dL/dv of this sample
        }
    }
  }

  void backward(const Windows<T>& data, int64_t first, int64_t n) {
    const int64_t wide = packed.wide;
    T back[CHUNK * 3], into[CHUNK * 3];
    std::copy_n(error.data + steps * most * 3, n * 3, back);
    int64_t held = 0;  // steps whose deltas wait
    for (int64_t k = steps - 1; k >= 0; --k) {
      const T* dt = data.dt + k * data.count + first;
      T* o = last.data + held * n * 3;
      for (int64_t row = 0; row < n; ++row)
        for (int64_t i = 0; i < 3; ++i)
          o[row * 3 + i] = back[row * 3 + i] * dt[row] * net.output_std[i];
      const T* above = o;
      for (int64_t l = net.depth - 1; l >= 0; --l) {
        T* d = delta.data + (l * flush * most + held * n) * wide;
        const bool top = l == net.depth - 1;
        layer<T, Then::slope>(n, above, top ? 3 : wide, packed.backward[l + 1].data,
                              top ? 3 : net.width, packed.panels, hidden_at(l, k), wide, d, wide);
        above = d;
      }
      three(n, above, wide, packed.from_velocity.data, wide, into);
      const T *x = input_at(k), *e = error.data + k * most * 3;
      for (int64_t row = 0; row < n; ++row)
        for (int64_t i = 0; i < 3; ++i) {
          const T z = x[row * packed.stride + i];
          const T through = net.input_tanh ? T(1) - z * z : T(1);
          back[row * 3 + i] += into[row * 3 + i] * through / net.input_std[i] + e[row * 3 + i];
        }
      if (++held == flush || k == 0) {
        weights(k, held, n);
        held = 0;
      }
    }
  }

  // Deltas of `held` steps, the last one of them step k, into the weights' gradient. Their rows are
  // in the order in which they came: backwards in time.
  void weights(int64_t k, int64_t held, int64_t n) {
    const int64_t wide = packed.wide, m = held * n, rows = flush * most;
    for (int64_t l = 0; l <= net.depth; ++l) {
      const bool inner = l > 0 && l < net.depth;
      T* tile = tiles.data;
      const T* own = l < net.depth ? delta.data + l * rows * wide : last.data;
      if (l == 0) {  // inputs by deltas: there are fewer of the former
        gather(held, n, [&](int64_t s) { return input_at(k + held - 1 - s); }, packed.stride);
        pack_tiles(m, packed.stride, right.data, packed.stride, tile);
        pack_panels(m, packed.panels, own, wide, right.data);
      } else {
        const int64_t columns = inner ? net.width : 3;
        pack_tiles(m, columns, own, inner ? wide : 3, tile);
        panels_of(l - 1, k, held, n);
        for (int64_t i = 0; i < m; ++i)
          for (int64_t c = 0; c < columns; ++c) bias[l].data[c] += own[i * (inner ? wide : 3) + c];
      }
      const int64_t columns = l == 0 ? packed.stride : inner ? net.width : 3;
      add_outer(m, tile, tiled(columns) / ROWS, right.data, packed.panels, gradient[l].data);
    }
  }

  template <class From> void gather(int64_t held, int64_t n, From from, int64_t stride) {
    for (int64_t s = 0; s < held; ++s)
      std::copy_n(from(s), n * stride, right.data + s * n * stride);
  }

  // Hidden layer l of `held` steps, in the order of their deltas, as panels.
  void panels_of(int64_t l, int64_t k, int64_t held, int64_t n) {
    const int64_t m = held * n;
    for (int64_t s = 0; s < held; ++s) {
      const T* h = hidden_at(l, k + held - 1 - s);
      for (int64_t p = 0; p < packed.panels; ++p) {
        T* to = right.data + (p * m + s * n) * PANEL<T>;
        pack_panels(n, 1, h + p * PANEL<T>, packed.wide, to);
      }
    }
  }
};

template <class T>
double rollouts(const Network<T>& net, const Windows<T>& data, T* const* gradients, int threads) {
  if (data.count < 1 || data.steps < 1) return std::nan("");
  const Packed<T> packed(net);
  const int64_t chunks = (data.count + CHUNK - 1) / CHUNK;
  const int64_t groups = std::min(GROUPS, chunks), most = (data.count + chunks - 1) / chunks;
  std::vector<double> loss(groups);
  std::vector<std::vector<Memory<T>>> gradient(groups), bias(groups);
  const auto work = [&](int64_t group) {
    Space<T> space(net, packed, data.steps, most, gradients != nullptr);
    for (int64_t c = group; c < chunks; c += groups) {
      const int64_t first = data.count * c / chunks;
      space.add(data, first, data.count * (c + 1) / chunks - first);
    }
    loss[group] = space.loss;
    gradient[group] = std::move(space.gradient);
    bias[group] = std::move(space.bias);
  };
  in_parallel(groups, threads, work);

  double total = 0.0;
  for (int64_t g = 0; g < groups; ++g) total += loss[g];
  if (gradients == nullptr) return total / double(data.count);
  const int64_t wide = packed.wide;
  for (int64_t l = 0; l <= net.depth; ++l) {
    const int64_t rows = l == 0 ? net.inputs : l < net.depth ? net.width : 3;
    const auto sum = [&](auto& of, int64_t at) {
      T s = of[0][l].data[at];
      for (int64_t g = 1; g < groups; ++g) s += of[g][l].data[at];
      return s;
    };
    T *w = gradients[2 * l], *b = gradients[2 * l + 1];
    if (l == 0) {
      for (int64_t n = 0; n < net.width; ++n) {
        for (int64_t i = 0; i < rows; ++i) w[n * rows + i] = sum(gradient, i * wide + n);
        b[n] = sum(gradient, rows * wide + n);
      }
    } else {
      for (int64_t n = 0; n < rows; ++n) {
        for (int64_t i = 0; i < net.width; ++i) w[n * net.width + i] = sum(gradient, n * wide + i);
        b[n] = sum(bias, n);
      }
    }
  }
  return total / double(data.count);
}

template <class T>
void adam(T* weight, T* mean, T* square, const T* gradient, int64_t size, int64_t step,
          double rate, double decay) {
  constexpr double FIRST = 0.9, SECOND = 0.999, LEAST = 1e-8;
  const T first = T(FIRST), second = T(SECOND), keep = T(decay), least = T(LEAST);
  const T scale = T(rate / (1.0 - std::pow(FIRST, double(step))));
  const T root = T(1.0 / std::sqrt(1.0 - std::pow(SECOND, double(step))));
  for (int64_t i = 0; i < size; ++i) {
    const T g = gradient[i] + keep * weight[i];
    mean[i] = first * mean[i] + (T(1) - first) * g;
    square[i] = second * square[i] + (T(1) - second) * g * g;
    weight[i] -= scale * mean[i] / (std::sqrt(square[i]) * root + least);
  }
}
