#include "gamer/core/cancellation.h"

#include <utility>

namespace gamer {
namespace {

thread_local const Cancellation* own_cancellation = nullptr;

}  // namespace

CancellationScope::CancellationScope(const Cancellation* cancellation)
    : before_(std::exchange(own_cancellation, cancellation)) {}

CancellationScope::~CancellationScope() { own_cancellation = before_; }

const Cancellation* CancellationScope::current() { return own_cancellation; }

void check_cancelled() {
  if (own_cancellation != nullptr && own_cancellation->is_requested()) throw Cancelled();
}

}  // namespace gamer
