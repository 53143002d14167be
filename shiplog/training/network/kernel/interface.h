// Loss and gradient of rollouts of a tanh network: what the Python side hands over (kernel.py).
//
// T is float or double, all arrays are contiguous. Layers are numbered from the input; a network of
// depth D has D hidden layers and one linear output layer of three accelerations.
#pragma once

#include <cstdint>

namespace shiplog {

template <class T> struct Network {
  int64_t depth;       // hidden layers, at least 1
  int64_t width;       // units of each hidden layer
  int64_t inputs;      // three velocities, then what drives the ship
  int64_t input_tanh;  // 1: tanh of the standardised velocities
  const T* const* weights;  // [2 (depth + 1)] W [out, in], b [out], layer by layer
  const T* input_mean;      // [3] of the velocities; likewise the next three
  const T* input_std;
  const T* output_mean;
  const T* output_std;
  const T* error_weights;  // [3] squared weights of the velocity errors
};

template <class T> struct Windows {
  int64_t steps;      // Euler steps, one less than samples
  int64_t count;      // windows
  const T* velocity;  // [steps + 1, count, 3]
  const T* driven;    // [steps + 1, count, inputs - 3] standardised
  const T* dt;        // [steps, count]
};

// The loss, a mean over windows; not a number where there is no window or no step, and then
// `gradients` are not set. `gradients` has the layout of `weights`, or is null. Windows are
// dealt to at most `threads` threads; the bits of the result do not depend on how many there are.
template <class T>
using Rollouts = double (*)(const Network<T>&, const Windows<T>&, T* const* gradients, int threads);

// One update of Adam (Kingma and Ba, 2015) over `size` weights, in place.
template <class T>
using Adam = void (*)(T* weight, T* mean, T* square, const T* gradient, int64_t size, int64_t step,
                      double rate, double decay);

struct Level {
  const char* name;
  Rollouts<float> rollouts_f32;
  Rollouts<double> rollouts_f64;
  Adam<float> adam_f32;
  Adam<double> adam_f64;
};

extern const Level portable_level;
#if defined(__x86_64__)
extern const Level avx2_level;
extern const Level avx512_level;
#endif

}  // namespace shiplog
