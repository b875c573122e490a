# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of all operators: poll, and reports of `HairError` without changes."""

from .....core.errors import HairError, memory_as_sentence
from ....data import whole_changes
from ....groom.selection import guides_of, hair_of, surface_of
from ....settings.translations import CONTEXT, error_text, report_text


@classmethod
def needs_hair(cls, context):
    """`applies` of operators on the active hair."""
    cls.poll_message_set("Select hair.")
    return hair_of(context.object) is not None


@classmethod
def needs_guides(cls, context):
    """`applies` of operators on the guides of the active hair or mesh."""
    cls.poll_message_set("Select guides, the mesh they grow on, or hair that follows them.")
    return guides_of(context.object) is not None


@classmethod
def needs_hair_or_guides(cls, context):
    """`applies` of operators on settings of the active hair or of its guides."""
    cls.poll_message_set("Select hair or guides.")
    return hair_of(context.object) is not None or guides_of(context.object) is not None


@classmethod
def needs_surface(cls, context):
    """`applies` of operators on a surface in Object Mode: the active mesh, or that of the active hair."""
    cls.poll_message_set("Select a mesh, or hair on one, in Object Mode.")
    return context.mode == "OBJECT" and surface_of(context.object) is not None


class HairOperator:
    """Mixin of operators that implement `change`, which raises `HairError` before anything is changed."""

    bl_options = {"REGISTER", "UNDO"}
    bl_translation_context = CONTEXT

    applies = (
        None  # class method of (context): whether the operator can run on the active object; sets the poll message
    )

    @classmethod
    def poll(cls, context):
        """Whether the operator `applies`; false without a window, as there is no active object."""
        return cls.applies is None or (hasattr(context, "object") and cls.applies(context))

    @classmethod
    def may_be_redone(cls, context):
        """Whether this was the last operator: Blender polls it before it undoes its result for the redo panel."""
        done = context.window_manager.operators
        return context.object is not None and len(done) > 0 and done[-1].bl_idname == cls.__name__

    def change(self, context):
        """Run the operator; returns (sentence, values) to report, or None."""
        raise NotImplementedError

    def execute(self, context):
        """Run `change` and report its message or its `HairError`."""
        try:
            with memory_as_sentence(), whole_changes.whole_change(getattr(context, "object", None)):
                message = self.change(context)
        except HairError as error:
            return self.refuse(error)
        if message is not None:
            self.report({"INFO"}, report_text(message[0], **message[1]))
        return {"FINISHED"}

    def refuse(self, error):
        """Report a `HairError`."""
        self.report({"ERROR"}, error_text(error))
        return {"CANCELLED"}
