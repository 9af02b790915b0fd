#include "studio/studio_core.h"

#include <exception>
#include <functional>
#include <new>
#include <utility>

#include "gamer/core/error.h"
#include "studio/child_process.h"
#include "studio/draft.h"
#include "studio/view.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

// Messages that wait for their answers, of all pages.
constexpr std::size_t most_waiting = 1000;

/// Runs a piece of work, and reports its exceptions to the page.
void report(Page& page, std::int64_t id, const std::function<void()>& work) {
  try {
    work();
  } catch (const std::bad_alloc&) {
    page.fail(id, "gstudio: out of memory");
  } catch (const std::exception& error) {
    page.fail(id, error.what());
  }
}

}  // namespace

StudioCore::StudioCore(const StudioOptions& options)
    : options_(options),
      session_(options.threads),
      answers_(session_, open_document(options, session_)),
      label_(answers_.document().label),
      paths_(answers_.paths()),
      views_([this](std::int64_t id, const ViewRequest& request, const Cancellation& cancellation,
                    const Send& send) {
        paths_.check(request.document);
        return render_view(session_, label_, id, request, cancellation, send);
      }) {}

void StudioCore::receive(const std::shared_ptr<Page>& page, std::string_view text) {
  try {
    start(page, parse_message(text));
  } catch (const BadMessage& error) {
    page->fail(error.id(), error.what());
  }
}

void StudioCore::start(const std::shared_ptr<Page>& page, Message message) {
  if (auto* view = std::get_if<ViewRequest>(&message.request)) {
    page->drop_frames();
    return views_.ask(page, message.id, std::move(*view));
  }
  if (auto* draft = std::get_if<DraftRequest>(&message.request)) {
    return views_.ask_draft(page, message.id,
                            [this, id = message.id, request = std::move(*draft)](
                                const Cancellation& cancellation, const Send& send) {
                              paths_.check(request.document);
                              return send_draft(make_draft(session_, label_, request, cancellation),
                                                id, send);
                            });
  }
  if (const auto* request = std::get_if<CancelRequest>(&message.request)) {
    return cancel(page, *request);
  }
  if (waiting_.size() >= most_waiting) return page->fail(message.id, "too many messages wait");
  waiting_.add([this, page, message = std::move(message)] {
    report(*page, message.id, [&] { answer(page, message); });
  });
}

void StudioCore::cancel(const std::shared_ptr<Page>& page, const CancelRequest& request) {
  const bool was_there =
      request.target ? renders_.cancel(*page, *request.target) : views_.cancel(*page);
  if (!request.target) page->drop_frames();
  if (!was_there) page->reply({{"op", "cancelled"}, {"id", nullptr}});
}

void StudioCore::answer(const std::shared_ptr<Page>& page, const Message& message) {
  std::visit(
      [&](const auto& request) {
        using Request = std::decay_t<decltype(request)>;
        if constexpr (std::is_same_v<Request, RenderRequest>) {
          render(page, message.id, request);
        } else if constexpr (std::is_invocable_v<Answers&, const Request&>) {
          Json reply = answers_(request);
          if constexpr (std::is_same_v<Request, OutputsRequest>) reply["jobs"] = renders_.list();
          reply["id"] = message.id;
          page->reply(reply);
        }
      },
      message.request);
}

void StudioCore::render(const std::shared_ptr<Page>& page, std::int64_t id,
                        const RenderRequest& request) {
  std::vector<std::string> words = answers_.prepare(request);
  words.front() = program_beside(words.front());
  words.insert(words.end(), {"--log", "json", "-j", std::to_string(options_.threads)});
  renders_.add({page, id, request.name, std::move(words)});
}

void StudioCore::leave(const Page& page) { views_.cancel(page); }

}  // namespace gamer
