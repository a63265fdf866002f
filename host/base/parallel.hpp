// A loop over threads, for work whose pieces do not depend on each other.
#pragma once
#include <atomic>
#include <cstddef>
#include <functional>

namespace rotorloop {

// Calls work(i) for each i < count with at most `workers` threads, this one among them (fewer than one counts as one). Pieces are begun
// in the order of i; when one throws, or `stop` is set, no further one is begun. After all threads have ended, the exception of the
// lowest i is thrown: as pieces before it had been begun, it is the same one with any number of workers.
void parallel_for(std::size_t count, int workers, const std::function<void(std::size_t)>& work, const std::atomic<bool>* stop = nullptr);

}  // namespace rotorloop
