#include "studio/studio_core.h"

#include <exception>
#include <new>
#include <utility>

#include "studio/galaxy_text.h"
#include "studio/model.h"
#include "studio/view.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

// Messages that wait for their answers, of all pages.
constexpr std::size_t most_waiting = 1000;

/// A galaxy's text in messages about errors, beside which it names others.
std::string galaxy_label(const OpenedDocument& document) {
  return (std::filesystem::path(document.label).parent_path() / "galaxy").generic_string();
}

/// What answers a message that needs no render.
struct Answer {
  const OpenedDocument& document;
  const Session& session;

  Json operator()(const OpenRequest&) const { return document_json(document, session); }
  Json operator()(const EditRequest& request) const {
    const std::string label = request.is_galaxy ? galaxy_label(document) : document.label;
    std::string text = edit_text(request.text, request.edits, label);
    if (!request.is_galaxy) return {{"op", "edited"}, {"parameters", text}};
    Json model = model_json(text, label, session.folders());
    return {{"op", "edited"}, {"galaxy_text", text}, {"model", model}};
  }
  Json operator()(const ModelRequest& request) const {
    return {{"op", "model"},
            {"model", model_json(request.text, galaxy_label(document), session.folders())}};
  }
  template <typename Other>
  Json operator()(const Other&) const {
    throw InputError("this operation is not there yet");
  }
};

}  // namespace

StudioCore::StudioCore(const StudioOptions& options)
    : session_(options.threads),
      document_(open_document(options, session_)),
      views_([this](std::int64_t id, const ViewRequest& request, const Cancellation& cancellation,
                    const Send& send) {
        render_view(session_, document_.label, id, request, cancellation, send);
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
    return views_.ask(page, message.id, std::move(*view));
  }
  if (std::holds_alternative<CancelRequest>(message.request)) {
    if (!views_.cancel(*page)) page->reply({{"op", "cancelled"}, {"id", nullptr}});
    return;
  }
  if (answers_.size() >= most_waiting) return page->fail(message.id, "too many messages wait");
  answers_.add([this, page, message = std::move(message)] {
    try {
      Json reply = answer(message);
      reply["id"] = message.id;
      page->reply(reply);
    } catch (const std::bad_alloc&) {
      page->fail(message.id, "gstudio: out of memory");
    } catch (const std::exception& error) {
      page->fail(message.id, error.what());
    }
  });
}

Json StudioCore::answer(const Message& message) const {
  return std::visit(Answer{document_, session_}, message.request);
}

void StudioCore::leave(const Page& page) { views_.cancel(page); }

}  // namespace gamer
