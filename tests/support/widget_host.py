"""The notebook's widget without a notebook: its messages as lines of JSON, in and out.

    python -m support.widget_host BUNDLE

Each line in is what a page sends, `{"data": ..., "buffers": [base64]}`, or `{"run": statement}`,
which has the widget as `viewer`, or `{"ask": expression}`, whose value comes back.
"""

import base64
import json
import sys
from typing import Any

import comm
from comm.base_comm import BaseComm


class LineComm(BaseComm):
    def publish_msg(
        self,
        msg_type: str,
        data: Any = None,
        metadata: Any = None,
        buffers: Any = None,
        **_: Any,
    ) -> None:
        if msg_type == "comm_open" and "_esm" not in data["state"]:
            self.publish_msg = lambda *_, **__: None  # type: ignore[method-assign]
            return  # the layout is a widget of its own
        packed = [base64.b64encode(bytes(one)).decode() for one in buffers or ()]
        print(json.dumps({"type": msg_type, "data": data, "buffers": packed}), flush=True)


def main() -> None:
    comm.create_comm = LineComm
    import stereocell

    viewer = stereocell.show(sys.argv[1], height=240)  # pixels; small, as software draws it
    for line in sys.stdin:
        request = json.loads(line)
        if "run" in request:
            exec(request["run"], {"viewer": viewer})
        elif "ask" in request:
            try:
                answer = {"answer": eval(request["ask"], {"viewer": viewer})}
            except (KeyError, NameError, TypeError) as fault:
                answer = {"fault": repr(fault)}
            print(json.dumps(answer), flush=True)
        else:
            buffers = [memoryview(base64.b64decode(one)) for one in request["buffers"]]
            viewer.comm.handle_msg({"content": {"data": request["data"]}, "buffers": buffers})


if __name__ == "__main__":
    main()
