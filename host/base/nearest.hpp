// Which word of a list a misspelt one was meant to be, so that an error can say it.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop {

// Fewest insertions, deletions, substitutions and swaps of neighbours that make `b` of `a`.
std::size_t edit_distance(std::string_view a, std::string_view b);

// The word of `allowed` nearest to `word`, or empty when none is near enough to be meant: up to a third of its letters differ, or only
// the unit at its end is missing ("mass" for "mass_kg"). Case does not count, nor does '-' for '_'. The first of several equally near.
std::string nearest(std::string_view word, const std::vector<std::string>& allowed);

// For a remedy: "did you mean "seeds"? " with the blank behind it, or empty.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& allowed);

// True where key `given` can only be a slip of key `wanted`: one of the parts between '_' has a slip of the pen (not kp for kd, x for y,
// 1 for 2, min for max), or the unit at the end is another ("mass_g") or missing. Says no in doubt: both may be keys of the file.
bool slip_of_key(std::string_view given, std::string_view wanted);

}  // namespace rotorloop
