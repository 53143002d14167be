// Any processor with registers of 16 bytes.
#include <algorithm>
#include <cmath>

#include "interface.h"
#include "memory.h"

#define LANE_BYTES 16
#define ROWS 6

namespace shiplog {
namespace portable {
#include "products.h"
#include "rollouts.h"
}  // namespace portable
const Level portable_level = {"portable", portable::rollouts<float>, portable::rollouts<double>,
                              portable::adam<float>, portable::adam<double>};
}  // namespace shiplog
