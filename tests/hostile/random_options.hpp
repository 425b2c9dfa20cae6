#pragma once

#include <cstdint>

#include "core/options.hpp"

namespace ipminmax::testing {

/// Options drawn from the table: most at their default, others at a bound of their range, just
/// inside, anywhere; with wrong also outside or NaN. Limits of work stay small; no files, no MPI.
[[nodiscard]] SolverOptions random_table_options(std::uint64_t seed, bool wrong);

}  // namespace ipminmax::testing
