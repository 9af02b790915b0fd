#include "studio/page_socket.h"

#include <boost/asio/dispatch.hpp>
#include <boost/asio/post.hpp>
#include <string_view>
#include <utility>

#include "gamer/core/clock.h"

namespace gamer {
namespace {

namespace beast = boost::beast;
namespace asio = boost::asio;
namespace websocket = beast::websocket;

constexpr double messages_per_second = 200, message_burst = 400;
constexpr double bytes_per_second = 16.0 * (1 << 20), byte_burst = 32.0 * (1 << 20);
constexpr std::size_t most_waiting_bytes = std::size_t{1} << 30;
constexpr std::size_t write_buffer = std::size_t{1} << 16;

}  // namespace

// ---- Mailbox -----------------------------------------------------------------------------------

Mailbox::Mailbox(const std::shared_ptr<PageSocket>& socket, asio::any_io_executor server)
    : socket_(socket), server_(std::move(server)) {}

void Mailbox::send(std::string message, bool is_binary) {
  asio::post(server_, [socket = socket_,
                       outgoing = PageSocket::Outgoing{std::move(message), is_binary}]() mutable {
    if (const auto open = socket.lock()) open->enqueue(std::move(outgoing));
  });
}

void Mailbox::drop_frames() {
  asio::dispatch(server_, [socket = socket_] {
    if (const auto open = socket.lock()) open->drop_frames();
  });
}

// ---- PageSocket --------------------------------------------------------------------------------

int PageSocket::count_ = 0;

PageSocket::PageSocket(beast::tcp_stream stream, StudioCore& core)
    : socket_(std::move(stream)),
      pause_(socket_.get_executor()),
      core_(core),
      messages_(messages_per_second, message_burst),
      bytes_(bytes_per_second, byte_burst) {
  ++count_;
}

PageSocket::~PageSocket() { --count_; }

void PageSocket::accept(const beast::http::request<beast::http::empty_body>& request) {
  beast::get_lowest_layer(socket_).expires_never();
  socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
  socket_.read_message_max(most_message_bytes);
  socket_.write_buffer_bytes(write_buffer);
  socket_.auto_fragment(false);
  socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
    if (error) return;
    self->mailbox_ = std::make_shared<Mailbox>(self, self->socket_.get_executor());
    self->read();
  });
}

void PageSocket::read() {
  socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    self->take(error);
  });
}

void PageSocket::take(beast::error_code error) {
  if (error) return leave();
  if (!socket_.got_text()) return close("messages are texts");
  const auto data = buffer_.data();
  const std::string_view text(static_cast<const char*>(data.data()), data.size());
  const double wait = std::max(messages_.take(1, steady_seconds()),
                               bytes_.take(double(text.size()), steady_seconds()));
  core_.receive(mailbox_, text);
  buffer_.consume(buffer_.size());
  if (wait <= 0) return read();
  pause_.expires_after(std::chrono::microseconds(static_cast<long long>(wait * 1e6)));
  pause_.async_wait([self = shared_from_this()](beast::error_code) { self->read(); });
}

void PageSocket::enqueue(Outgoing outgoing) {
  if (!mailbox_) return;
  waiting_bytes_ += outgoing.message.size();
  outgoing_.push_back(std::move(outgoing));
  if (waiting_bytes_ > most_waiting_bytes) return close("the page does not read its messages");
  if (outgoing_.size() == 1) write();
}

void PageSocket::drop_frames() {
  if (outgoing_.size() < 2) return;
  for (auto one = outgoing_.begin() + 1; one != outgoing_.end();) {
    if (!one->is_binary) {
      ++one;
      continue;
    }
    waiting_bytes_ -= one->message.size();
    one = outgoing_.erase(one);
  }
}

void PageSocket::write() {
  socket_.binary(outgoing_.front().is_binary);
  socket_.async_write(asio::buffer(outgoing_.front().message),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        if (error) return self->leave();
                        self->waiting_bytes_ -= self->outgoing_.front().message.size();
                        self->outgoing_.pop_front();
                        if (!self->outgoing_.empty()) self->write();
                      });
}

void PageSocket::close(const std::string& reason) {
  leave();
  socket_.async_close({websocket::close_code::policy_error, reason},
                      [self = shared_from_this()](beast::error_code) {});
}

void PageSocket::leave() {
  if (!mailbox_) return;
  core_.leave(*mailbox_);
  mailbox_.reset();
}

}  // namespace gamer
