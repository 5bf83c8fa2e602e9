"""One mesh of a whole part taken apart into its round body and what stands on it.

Modules: ``decompose``, ``axis`` and ``axis_candidates``, ``body_hint`` (what is known of the body beforehand),
``outline`` and ``outline_ends`` (profile of the body), ``robust_line`` (lines through most values), ``turned_faces``
and the ``bands`` that they make, ``turned_steps`` (what goes round the body and belongs to it), ``lands`` (what
grooves leave of a bar), ``cut``, ``evidence_warnings`` and ``piece_doubts`` (what is doubtful, as warnings).
"""
