#pragma once

#include "core/certificate/candidate.hpp"

namespace ipminmax {

/// What is said of a point that gets no certificate: that it is refuted, by a witness; that it is
/// flat; or why neither is known.
[[nodiscard]] SecondOrder judge_without_certificate(TestContext& c, Candidate& candidate);

}  // namespace ipminmax
