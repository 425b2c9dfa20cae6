#pragma once

namespace ipminmax {

/// Base of adapters whose models may have one player only, without anything having been forgotten.
class OptionalPlayers {
 protected:
  OptionalPlayers() = default;
  virtual ~OptionalPlayers() = default;
};

}  // namespace ipminmax
