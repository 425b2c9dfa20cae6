#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <IpOptionsList.hpp>

#include "../../core/problem.hpp"
#include "ipopt_version.hpp"

/// @file
/// Options minmax_max_variables, minmax_max_constraints and minmax_min_constraints: who is Max, and
/// which constraints are robust, for programs that can only pass options.
namespace IPMINMAX_API ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Variables or constraints that a list may name.
struct ListedItems {
  std::string_view what;                            ///< "variable" or "constraint"
  Index count = 0;                                  ///< indices are 0 to count - 1
  const std::vector<std::string>* names = nullptr;  ///< count names, or null or empty: none
  std::size_t names_given = 0;  ///< where they are not count, so that none is used
};

/// Reads a list as "3 5-9 speed[2] wind": indices from 0, ranges, names. Entries are separated by
/// blanks or commas outside brackets and quotes; digits alone are an index; a name without brackets
/// also stands for all entries of an indexed name, wind for wind[1], wind[2].
/// indices: what the list names, ascending. Returns what is wrong ("there is no variable 7: the
/// model has 3, counted from 0"), empty when nothing is.
[[nodiscard]] std::string read_index_list(std::string_view list, const ListedItems& items,
                                          std::vector<Index>& indices);

/// Values of the options; empty: not set.
struct PlayerOptions {
  std::string max_variables;
  std::string max_constraints;
  std::string min_constraints{};
  std::string stated_by{};  ///< what gives the model's own players, in messages; empty: its method
  friend bool operator==(const PlayerOptions&, const PlayerOptions&) = default;
};
[[nodiscard]] PlayerOptions player_options(const Ipopt::OptionsList& list);

/// What the model itself says about players.
struct StatedPlayers {
  std::string_view source;             ///< in messages, as "metadata \"player\""
  const std::vector<Player>& implied;  ///< count; players where nothing is said
};

/// Gives what the option lists to Max. players: count, in what the model states, out with the
/// option's; a model that states what is implied has stated nothing. Returns an error that names
/// the option and the source when they disagree, or what is wrong with the list; empty when nothing
/// is. option: the option's name; an empty list changes nothing.
[[nodiscard]] std::string apply_player_option(std::string_view option, std::string_view list,
                                              const ListedItems& items, const StatedPlayers& stated,
                                              std::vector<Player>& players);

/// Gives the constraints that minmax_min_constraints lists to Min: those that read Max variables
/// become robust. players: count, in and out. Returns what is wrong, a constraint that
/// minmax_max_constraints lists too among that; empty when nothing is.
[[nodiscard]] std::string apply_min_constraints(const PlayerOptions& options,
                                                const ListedItems& items,
                                                std::vector<Player>& players);

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
